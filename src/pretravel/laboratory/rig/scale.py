"""The scale of a rig against a reference: line, periodic part and scatter of its errors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.base import MICROMETRE, FloatArray, IntArray, PretravelError, as_numbers, frozen
from pretravel.laboratory.rig.budget import LengthComponent
from pretravel.touches import copied_rows_warnings

SCALE_SOURCE = "grating scale"
"""Names of sources in a budget that begin so are replaced by the result of a check."""
_FEWEST = 20
_FEWEST_PERIODS = 3.0
_FINER = 8
"""Trial periods for each independent one."""
_ONE_PLACE = 0.1
"""Readings closer than this share of their mean distance are of one place."""
_FALSE_PERIOD = 0.01
"""Share of scales without a periodic part of which one is stated."""
_LARGEST_ERROR = 0.1
"""Errors beyond this are another unit or another place. [mm]"""


@dataclass(frozen=True, eq=False)
class ScaleCheck:
    """Errors of a scale against a reference.

    Attributes
    ----------
    position, error : (n,) float
        Reading of the scale, and scale less reference without the mean of its run. [mm]
    run : (n,) int
    largest_error : float
        Largest magnitude of an error. [mm]
    slope, u_slope : float
        Change of the error with the length, without unit: 1e-6 is 1 µm/m.
    period, amplitude : float
        Of the periodic part; nan and zero where none is above chance. [mm]
    scatter : float
        Standard deviation of what is left of a reading. [mm]
    dof : float
        Degrees of freedom of the scatter.
    """

    position: FloatArray
    error: FloatArray
    run: IntArray
    largest_error: float
    slope: float
    u_slope: float
    period: float
    amplitude: float
    scatter: float
    dof: float

    def components(self) -> tuple[LengthComponent, LengthComponent]:
        """The lines of a budget for a length between two readings, which is not corrected.

        The periodic part of each end has the phase that comes, its variance A²/2; scatter and
        periodic part enter twice. The slope enters as it is.
        """
        constant = math.sqrt(self.amplitude**2 + 2.0 * self.scatter**2)
        return (
            LengthComponent(f"{SCALE_SOURCE}, checked: periodic part and scatter", "A", constant,
                            dof=self.dof),
            LengthComponent(f"{SCALE_SOURCE}, checked: slope", "A", 0.0,
                            math.hypot(self.slope, self.u_slope)),
        )  # fmt: skip


def check_scale(
    scale: npt.ArrayLike, reference: npt.ArrayLike, run: npt.ArrayLike | None = None
) -> ScaleCheck:
    """Compare a scale with a reference on its line of measurement.

    Parameters
    ----------
    scale, reference : (n,) float
        Readings at the same places. [mm]
    run : (n,) int, optional
        Number of the run of each reading; each has its own zero. One run when not given.

    Raises
    ------
    PretravelError
        Fewer than 20 readings, readings of one place, errors beyond 0.1 mm.

    Notes
    -----
    Error = constant of the run + slope · reading + A cos(2π reading / period + phase) + scatter.
    The period with the smallest residual is searched between three periods in the range and two
    readings; it is stated where the F test, divided over the independent periods, is below 1 %.

    References
    ----------
    Ren 2020, Figure 9: three runs over 1 mm and over 5 mm, errors below 20 nm.

    >>> x = np.linspace(0.0, 1.0, 101)
    >>> check = check_scale(x + 8e-6 * np.sin(2 * np.pi * x / 0.1), x)
    >>> round(check.period, 6), round(check.amplitude * 1e6, 3)  # mm, nm
    (0.1, 8.0)
    """
    position, other = as_numbers(scale, "readings of the scale"), as_numbers(reference, "readings")
    runs = np.zeros(len(position), dtype=np.int64) if run is None else np.asarray(run, np.int64)
    if not position.shape == other.shape == runs.shape or position.ndim != 1:
        raise PretravelError(
            f"{position.shape} readings of the scale, {other.shape} of the reference and "
            f"{runs.shape} runs: expected three columns of one length"
        )
    if len(position) < _FEWEST or np.ptp(position) == 0.0:
        raise PretravelError(
            f"{len(position)} readings over {np.ptp(position) if len(position) else 0.0:g} mm do "
            f"not check a scale; at least {_FEWEST} at different places are needed"
        )
    own = np.equal.outer(runs, np.unique(runs)).astype(np.float64)
    error = position - other
    error = error - own @ (own.T @ error / own.sum(axis=0))
    if np.abs(error).max() > _LARGEST_ERROR:
        raise PretravelError(
            f"scale and reference differ by up to {np.abs(error).max():.3g} mm after the zero of "
            "their runs: are both in mm, and do they count the same way?"
        )
    line = np.column_stack([own, position])
    period, design = _periodic(position, runs, error, line)
    solution, *_ = np.linalg.lstsq(design, error, rcond=None)
    left = error - design @ solution
    dof = len(error) - design.shape[1]
    scatter = math.sqrt(float(left @ left) / dof)
    slope = own.shape[1]
    u_slope = scatter * math.sqrt(float(np.linalg.pinv(design.T @ design)[slope, slope]))
    return ScaleCheck(
        position=frozen(position),
        error=frozen(error),
        run=runs,
        largest_error=float(np.abs(error).max()),
        slope=float(solution[slope]),
        u_slope=u_slope,
        period=period,
        amplitude=float(np.hypot(*solution[slope + 1 :])) if design.shape[1] > slope + 1 else 0.0,
        scatter=scatter,
        dof=float(dof),
    )


def _periodic(
    position: FloatArray, runs: IntArray, error: FloatArray, line: FloatArray
) -> tuple[float, FloatArray]:
    """The period above chance and the design with it; nan and the line without one."""
    from scipy.special import fdtrc

    length = float(np.ptp(position))
    lowest, highest = _FEWEST_PERIODS / length, 0.5 * _steps(position, runs) / length
    independent = int((highest - lowest) * length) + 1
    if highest <= lowest:
        return math.nan, line

    def with_period(frequency: float) -> FloatArray:
        angle = 2.0 * math.pi * frequency * position
        return np.column_stack([line, np.cos(angle), np.sin(angle)])

    def squares(frequency: float) -> float:
        design = with_period(frequency)
        left = error - design @ np.linalg.lstsq(design, error, rcond=None)[0]
        return float(left @ left)

    trials = np.linspace(lowest, highest, _FINER * independent)
    found = np.array([squares(frequency) for frequency in trials])
    best, step = float(trials[np.argmin(found)]), float(trials[1] - trials[0])
    for _ in range(12):  # the smallest lies between the neighbours
        near = best + step * np.linspace(-1.0, 1.0, 9)
        best = float(near[np.argmin([squares(frequency) for frequency in near])])
        step *= 0.25
    without = error - line @ np.linalg.lstsq(line, error, rcond=None)[0]
    dof = len(error) - line.shape[1] - 3  # the period is fitted too
    with_it = squares(best)
    gain = float(without @ without) - with_it
    if not gain > 0.0 or dof < 1:
        return math.nan, line
    chance = float(fdtrc(3.0, dof, gain / 3.0 / max(with_it / dof, 1e-300)))
    if independent * chance > _FALSE_PERIOD:
        return math.nan, line
    return 1.0 / best, with_period(best)


def _steps(position: FloatArray, runs: IntArray) -> float:
    """Steps between different places in a run, on average: there and back is one place."""
    found = []
    for run in np.unique(runs):
        own = np.sort(position[runs == run])
        found.append(int(np.sum(np.diff(own) > _ONE_PLACE * np.ptp(position) / len(own))))
    return float(np.mean(found))


def scale_doubts(check: ScaleCheck) -> tuple[str, ...]:
    """What a check shows that a budget does not correct, as sentences.

    >>> x = np.linspace(0.0, 1.0, 101)
    >>> scale_doubts(check_scale(x * (1.0 + 5e-5), x))[0][:44]
    'the scale is longer than the reference by 50'
    """
    rows = np.column_stack([check.position, np.round(check.error, 9)])
    doubts = copied_rows_warnings(rows, lambda row: f"reading {row + 1} of the scale")
    if abs(check.slope) > max(4.0 * check.u_slope, 1e-5):
        longer = "longer" if check.slope > 0.0 else "shorter"
        doubts.append(
            f"the scale is {longer} than the reference by {abs(check.slope) * 1e6:.0f} µm/m: a "
            "wrong unit, a temperature, or a line of measurement that is inclined"
        )
    if check.largest_error > MICROMETRE:
        doubts.append(
            f"an error of the scale is {check.largest_error / MICROMETRE:.2f} µm, too large to "
            "measure the pretravel of a probe"
        )
    return tuple(doubts)
