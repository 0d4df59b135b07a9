"""The scatter of single touches by direction, from a separation of machine and probe."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from pretravel.base import (
    FloatArray,
    Placement,
    PretravelError,
    azimuth_angle,
    frozen,
    probe_rotation,
)
from pretravel.maps import PretravelMap

MACHINE_PART, PROBE_PART = "machine, separated", "probe, separated"
"""Names of the two parts in budgets. Their sum is measured, their shares are a convention."""
_TURN = 2.0 * math.pi
_ACROSS = 0.035
"""Cosine of a normal with the axis below which it is across: 2°."""


@dataclass(frozen=True, eq=False)
class TouchScatter:
    """Variances of machine and probe around the probe's axis.

    Parameters
    ----------
    machine_azimuth, machine_variance : (m,) float
        Of normals in the machine's frame. [rad], [mm²]
    probe_azimuth, probe_variance : (p,) float
        Of normals in the probe's frame. [rad], [mm²]
    machine_error : (m,) float
        The machine's errors along its normals, in their order; none where they are not known. [mm]
    to_machine : (3, 3) float
        Rotation from the frame of the touches to that of the machine.

    Raises
    ------
    PretravelError
        Azimuths that are not known; variances that are not finite, or negative for a pair.

    >>> from pretravel.maps.kinds.mean import MeanBasis
    >>> from pretravel.maps.support import DirectionSupport
    >>> from pretravel.uncertainty.covariance import Covariance
    >>> x, around = np.array([[1.0, 0.0, 0.0]]), np.arange(4) * 0.5 * np.pi
    >>> mean = PretravelMap(MeanBasis(), np.array([0.010]), Covariance.independent([1e-8]),
    ...                     DirectionSupport(x), tip_radius=3.0)
    >>> even = TouchScatter(around, np.full(4, 2e-7), around, np.full(4, 1e-7))
    >>> [round(float(part[0]), 12) for part in even.variances(x, mean)]
    [2e-07, 1e-07]
    """

    machine_azimuth: FloatArray
    machine_variance: FloatArray
    probe_azimuth: FloatArray
    probe_variance: FloatArray
    machine_error: FloatArray = field(default_factory=lambda: np.zeros(0))
    to_machine: FloatArray = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        for side in ("machine", "probe"):
            azimuth, variance = (
                getattr(self, f"{side}_{name}") for name in ("azimuth", "variance")
            )
            if len(azimuth) == 0 or not np.all(np.isfinite(azimuth)):
                raise PretravelError(
                    f"the separation does not give the azimuths of its {side} directions. "
                    "Separate touches with their orientations, or number the directions of machine "
                    "and probe 1 to n around the circle, as separation-plan does",
                    inputs=("machine",),
                )
            if not np.all(np.isfinite(variance)):
                raise PretravelError(f"a variance of the {side} is not finite", inputs=("machine",))
            order = np.argsort(np.mod(azimuth, _TURN))
            if side == "machine" and len(self.machine_error):
                object.__setattr__(self, "machine_error", frozen(self.machine_error[order]))
            object.__setattr__(self, f"{side}_azimuth", frozen(np.mod(azimuth, _TURN)[order]))
            object.__setattr__(self, f"{side}_variance", frozen(np.asarray(variance)[order]))
        if self.machine_variance.min() + self.probe_variance.min() < 0.0:
            raise PretravelError(
                "the separation gives a pair of directions a negative variance: separate with the "
                "method reml",
                inputs=("machine",),
            )

    def seen_from(self, part: Placement) -> TouchScatter:
        """The scatter for touches in the frame of a part."""
        return replace(self, to_machine=np.asarray(part.rotation))

    def variances(
        self, normals: FloatArray, pretravel_map: PretravelMap
    ) -> tuple[FloatArray, FloatArray]:
        """Parts of machine and probe in the variance of one touch.

        Parameters
        ----------
        normals : (n, 3) float
            Frame of the touches.
        pretravel_map : PretravelMap
            In the same frame. Its orientation is that in which the separation's probe had the
            orientation 0.

        Returns
        -------
        machine, probe : (n,) float
            Between the directions linear. The separation knows directions across the axis: what
            a normal has along it scatters as the repeatability of the map, which is in both parts
            as they are. [mm²]
        """
        return self._with_axial(normals, pretravel_map.rotation, pretravel_map.repeatability)

    def _with_axial(
        self, normals: FloatArray, rotation: FloatArray, repeatability: float
    ) -> tuple[FloatArray, FloatArray]:
        """Parts of machine and probe; along the axis by this repeatability. [mm²]"""
        seen = normals @ rotation
        machine = np.interp(self._at_machine(normals, rotation), self.machine_azimuth,
                            self.machine_variance, period=_TURN)  # fmt: skip
        of_probe = azimuth_angle(seen)
        probe = np.interp(of_probe, self.probe_azimuth, self.probe_variance, period=_TURN)
        along = seen[:, 2] ** 2
        pair = machine + probe
        share = np.where(pair > 0.0, machine / np.where(pair > 0.0, pair, 1.0), 0.5)
        total = (1.0 - along) * pair + along * repeatability**2
        return np.asarray(share * total), np.asarray((1.0 - share) * total)

    def _at_machine(self, normals: FloatArray, rotation: FloatArray) -> FloatArray:
        """Azimuths of normals as the machine's directions are counted."""
        # About the axis of a probe that is not turned.
        unturned = probe_rotation(self.to_machine @ rotation[:, 2], 0.0)
        return azimuth_angle(normals @ self.to_machine.T @ unturned)

    def drawn(
        self,
        normals: FloatArray,
        rotation: FloatArray,
        rng: np.random.Generator,
        axial: float | None = None,
    ) -> FloatArray:
        """Errors of touches along their normals: the machine's, and noise of both.

        Parameters
        ----------
        normals : (n, 3) float
            Frame of the touches.
        rotation : (3, 3) float
            Of the probe in this frame.
        rng : numpy.random.Generator
        axial : float, optional
            Standard deviation of a touch along the axis of the probe, which the separation does
            not know. [mm]

        Returns
        -------
        (n,) float
            Of the reported place, outward. [mm]

        Raises
        ------
        PretravelError
            Normals with a part along the axis, and no repeatability there.

        References
        ----------
        Nafi and Mayer 2011, section VI.
        """
        along = np.abs(normals @ rotation[:, 2])
        if axial is None and np.any(along > _ACROSS):
            raise PretravelError(
                "the separation only has directions across the axis of the probe, but some of "
                "these normals have a component along the axis: give the noise along the axis",
                inputs=("noise",),
            )
        deviation = np.sqrt(sum(self._with_axial(normals, rotation, axial or 0.0)))
        error = deviation * rng.standard_normal(len(normals))
        if len(self.machine_error):
            azimuth = self._at_machine(normals, rotation)
            across = np.sqrt(np.maximum(1.0 - along**2, 0.0))
            error += across * np.interp(
                azimuth, self.machine_azimuth, self.machine_error, period=_TURN
            )
        return np.asarray(error)
