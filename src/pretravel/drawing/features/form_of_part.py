"""The form of a part as an error of its features: from touch to touch, and common to a face.

Form is no noise: a bow or lobes move the touches of a face together, so that more touches do not
average them out. What the residuals show is compared with families of shapes; what they cannot show
keeps its probability from before the touches.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.special import chdtri

from pretravel.base import MICROMETRE, BoolArray, FloatArray, IntArray

UNSEEN = 1.0 * MICROMETRE
"""Standard deviation of the form over a face where no residual shows it: a plane through three
touches. That of a face that was milled or ground; a bow of 3 µm has 0.9 µm. [mm]"""
_RARE = 0.01  # probability that noise alone is taken for form
_PERFECT = 0.1
"""Probability, before the touches, that a surface has no form at all: a lapped one. What
is turned, milled, bored or ground is off by 0.1 to 10 µm."""
_SMOOTH = 0.5  # that a form is of one of the families, alone or …
_BOTH = 0.4  # … together with roughness
_NOT_EXCLUDED = 0.05  # probability of roughness alone, from which U covers it by itself
_SIZES = 24  # of the form of a part that are tried
_UNLIKELY = 0.03  # of the residuals: smaller forms and errors would not leave them
_LEAST, _MOST = 0.3, 30.0  # of them, in standard deviations of the noise and of the residuals
_SEEN_AT_ALL = 0.1  # of the largest shape of a family
_VISIBLE = 0.1  # least share of a shape in the residuals: one below is named, not tried
_MOST_FILLED = 0.5  # largest share of the degrees of freedom that a feature's family takes
_FAR_BEYOND = 3.0  # times the errors: residuals from which it matters what they are
LOBES = range(2, 13)
"""Numbers of lobes of a round surface that are tried."""
_MANY_LOBES = 10  # more than chucks, drills and reamers leave: a note, not a warning
_MOST_TOUCHES = 50_000  # more are taken as rough alone
_ROUGHEST = 10.0 * MICROMETRE
"""Standard deviation from touch to touch, from which shapes that fill the few residuals are
likelier than roughness: a tip ball touches the peaks of what was turned or milled. [mm]"""
_WRONG_TOUCH = 0.07
"""Probability, before the touches, that one of five is wrong, on a chip: 1.4 % of touches. It is
treated as roughness, and moves the feature, whatever the size."""
MANY_SHAPES = 600
"""Of all faces together: more are kept as a sparse array, with a spectrum for each face."""
_SEEN = 1e-5  # probability of a size that is kept
_BINS = 60

Shapes = Any
"""(n, f) float; a sparse array of SciPy where many shapes are those of one face each."""


@dataclass(frozen=True, eq=False)
class Family:
    """Shapes of a form that differ in their phases.

    Attributes
    ----------
    name : str
        In words, as "3 lobes".
    columns : (n, f) float
        The shapes at the touches; the mean of their squares' sum over the face is 1.
    share : float
        Probability before the touches, in relation to that of the other families.
    face : (n,) int, optional
        Of each touch, where each shape is that of one face.
    in_parts : str
        What to call single shapes of it that the touches cannot show, where these are named too.
    """

    name: str
    columns: Shapes
    share: float = 1.0
    face: IntArray | None = None
    in_parts: str = ""


@dataclass(frozen=True, eq=False)
class FormOfPart:
    """What the residuals of a feature say of the form of its surface.

    Attributes
    ----------
    rough : float
        Standard deviation from touch to touch that the uncertainty contains. [mm]
    smooth : (r, n) float
        Factors of the form that touches have in common, in the uncertainty too. [mm]
    families : tuple of (f, n) float
        The shapes that were tried.
    weights, rough_variances, smooth_variances : (c,) float
        Probabilities, and the sizes that they are of. Few residuals distinguish them poorly. [mm²]
    family : (c,) int
        Of `families`.
    shown : int
        Of `families`, the first, that residuals tell from roughness.
    hidden : tuple of str
        Families that the places of the touches cannot show.
    by_prior : bool
        No residual shows the form: the usual one stands for it.
    alike : tuple of str
        Families that these residuals do not tell from roughness, where the form is far larger than
        the errors: of a feature that they do not move, U is too large.
    telling : int
        Touches from which residuals tell them.
    place : (n,) int or None
        Of each touch, where places were touched several times: their form is one.
    """

    rough: float = 0.0
    smooth: Shapes = field(default_factory=lambda: np.zeros((0, 0)))
    families: tuple[Shapes, ...] = ()
    weights: FloatArray = field(default_factory=lambda: np.ones(1))
    rough_variances: FloatArray = field(default_factory=lambda: np.zeros(1))
    smooth_variances: FloatArray = field(default_factory=lambda: np.zeros(1))
    family: IntArray = field(default_factory=lambda: np.zeros(1, dtype=int))
    shown: int = 0
    hidden: tuple[str, ...] = ()
    by_prior: bool = False
    alike: tuple[str, ...] = ()
    telling: int = 0
    place: IntArray | None = None

    @property
    def excess(self) -> float:
        """Root mean square of the form from touch to touch that the uncertainty contains. [mm]"""
        common = _sum_of_squares(self.smooth) / max(self.smooth.shape[1], 1)
        return math.sqrt(self.rough**2 + common)

    def covariance(self, weights: FloatArray) -> FloatArray:
        """Of weighted sums of the touches' movements, (m, m) from (m, n). [mm²]"""
        own = self._of_places(weights)
        found = self.rough**2 * (own @ own.T)
        if self.smooth.shape[0]:
            moved = weights @ self.smooth.T
            found = found + moved @ moved.T
        return np.asarray(found)

    def _of_places(self, weights: FloatArray) -> FloatArray:
        """Sums of the weights of the touches at each place, (m, p) from (m, n)."""
        if self.place is None:
            return weights
        return np.array([np.bincount(self.place, row) for row in weights])

    def _rough_movements(
        self, trials: int, generator: np.random.Generator, count: int
    ) -> FloatArray:
        """Movements of the touches by roughness of unit size, (trials, n)."""
        if self.place is None:
            return generator.standard_normal((trials, count))
        return generator.standard_normal((trials, int(self.place.max()) + 1))[:, self.place]

    @property
    def _without_shown(self) -> BoolArray:
        return np.asarray((self.smooth_variances == 0.0) | (self.family >= self.shown))

    @property
    def may_be_rough(self) -> bool:
        """Whether residuals that look like smooth shapes may as well be of a surface without."""
        rough = float(self.weights[self._without_shown].sum() / self.weights.sum())
        return _NOT_EXCLUDED < rough < 1.0

    def variances(
        self, weights: FloatArray, *, rough: bool = False
    ) -> tuple[FloatArray, FloatArray]:
        """Variances of a weighted sum, (n,) weights, by sizes, and their probabilities. [mm²]

        Rough: of a surface without those shapes that residuals tell from roughness.
        """
        alone = float(np.sum(self._of_places(weights[None]) ** 2))
        common = np.array([float(np.sum((each @ weights) ** 2)) for each in self.families] or [0.0])
        mine = self._without_shown if rough else np.ones(len(self.weights), dtype=bool)
        each = self.rough_variances * alone + self.smooth_variances * common[self.family]
        return _binned(
            each[mine], self.weights[mine] / (self.weights[mine].sum() if rough else 1.0)
        )

    def share_of_noise(self, noise: float) -> float:
        """Share of the spread of the residuals that is noise, root mean square over the sizes.

        Parameters
        ----------
        noise : float
            Standard deviation of a residual by the errors of the points. [mm]
        """
        common = [_sum_of_squares(each) / max(each.shape[1], 1) for each in self.families]
        form = self.rough_variances + self.smooth_variances * np.array(common or [0.0])[self.family]
        share = 1.0 - np.sqrt(form / np.maximum(form + noise**2, 1e-300))
        return math.sqrt(float(self.weights @ share**2 / self.weights.sum()))

    def drawn(self, trials: int, generator: np.random.Generator, count: int) -> FloatArray:
        """Movements of the touches by this form, (trials, n). [mm]"""
        moved = self.rough * self._rough_movements(trials, generator, count)
        if self.smooth.shape[0]:
            moved += generator.standard_normal((trials, self.smooth.shape[0])) @ self.smooth
        return np.asarray(moved)

    def drawn_by_size(self, trials: int, generator: np.random.Generator, count: int) -> FloatArray:
        """The same by sizes and shapes with their probabilities, (trials, n). [mm]

        Few residuals leave the size uncertain: a form of the size of `excess` alone would have
        too few large movements, as the normal law has compared with Student's t.
        """
        if self.by_prior or not self.families:
            return self.drawn(trials, generator, count)
        chosen = generator.choice(len(self.weights), trials, p=self.weights / self.weights.sum())
        rough = np.sqrt(self.rough_variances[chosen])[:, None]
        moved = rough * self._rough_movements(trials, generator, count)
        size, family = np.sqrt(self.smooth_variances[chosen]), self.family[chosen]
        for index in np.unique(family):
            mine, factors = np.flatnonzero(family == index), self.families[index]
            amounts = size[mine, None] * generator.standard_normal((len(mine), factors.shape[0]))
            moved[mine] += amounts @ factors
        return np.asarray(moved)

    @property
    def _hidden_lobes(self) -> list[int]:
        return [int(text.split()[0]) for text in self.hidden if text.endswith(" lobes")]

    def hidden_form(self, touches: int) -> str:
        """Which form of the part so many touches cannot reveal; empty if there is none."""
        lobes = self._hidden_lobes
        if not self.hidden:
            return ""
        counts = " or ".join(", ".join(map(str, lobes)).rsplit(", ", 1))
        of_what = "size" if lobes else "size, direction"
        where = "these places" if self.place is None else f"{int(self.place.max()) + 1} places"
        more = " (more are not listed)" if lobes and lobes[-1] == LOBES[-1] else ""
        words = [f"{counts} lobes{more}"] if lobes else []
        words += [text for text in self.hidden if not text.endswith(" lobes")]
        return (
            f"{touches} touches at {where} cannot reveal every form deviation: "
            f"{' or '.join(words)} may leave no residuals there. Such a form would appear "
            f"as an error of {of_what} or position, and U does not contain it. If the part may "
            "have such a form, touch more places at unequal steps"
        )

    def sentences(self, touches: int) -> tuple[str, ...]:
        """What so many touches hide, and U does not contain or has by prior alone."""
        rare = min(self._hidden_lobes, default=0) >= _MANY_LOBES
        found = [self.hidden_form(touches)] if self.hidden and not rare else []
        if self.alike:
            shape = "lobes" if self.alike[0].endswith("lobes") else self.alike[0]
            found.append(
                f"{touches} touches cannot show whether their residuals come from {shape}, "
                "roughness or one wrong touch. U allows for each of these causes, and may be "
                f"several times too large. Touch {self.telling} or more places"
            )
        if self.by_prior:
            found.append(
                "no residual shows the form of the part; u contains a usual form of "
                f"{UNSEEN / MICROMETRE:g} µm (standard deviation over the face). Touch more places"
            )
        return tuple(found)


NO_FORM = FormOfPart()


def _sum_of_squares(columns: Shapes) -> float:
    if isinstance(columns, np.ndarray):
        return float(np.sum(columns**2))
    return float(columns.multiply(columns).sum())


def _stacked(factors: Sequence[Shapes]) -> Shapes:
    if all(isinstance(each, np.ndarray) for each in factors):
        return np.vstack(factors)
    from scipy.sparse import vstack

    return vstack(factors, format="csr")


def _binned(variances: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Fewer variances with the same mean, in bins of equal ratio."""
    if len(weights) <= _BINS:
        return variances, weights
    largest = float(variances.max())
    if largest <= 0.0:
        return np.zeros(1), np.ones(1)
    logs = np.log(np.maximum(variances, 1e-12 * largest))
    edges = np.linspace(logs.min(), logs.max() + 1e-9, _BINS + 1)
    bins = np.clip(np.searchsorted(edges, logs, side="right") - 1, 0, _BINS - 1)
    total = np.bincount(bins, weights, _BINS)
    mean = np.bincount(bins, weights * variances, _BINS) / np.maximum(total, 1e-300)
    used = total > 0.0
    return np.asarray(mean[used], dtype=np.float64), np.asarray(total[used], dtype=np.float64)


def form_of_part(
    residuals: FloatArray,
    jacobian: FloatArray,
    expected: float,
    families: Sequence[Family] = (),
) -> FormOfPart:
    """The form of a surface by the residuals of a feature of least squares.

    Parameters
    ----------
    residuals : (n,) float
        [mm]
    jacobian : (n, k) float
        Of the feature.
    expected : float
        Sum of the squared residuals that the errors of the points produce, on average. [mm²]
    families : sequence of Family
        Smooth shapes that are tried in addition to what is rough from touch to touch.

    Returns
    -------
    FormOfPart
        Its uncertainty contains a form where the errors alone would exceed the observed squares in
        less than one of a hundred cases.

    Notes
    -----
    Before the touches a surface has no form with a probability of 0.1, and all orders of magnitude
    of errors and form together are alike (Jeffreys' prior of a variance), so that U of a rough
    surface is that of Student's t, as without knowledge of the errors, where the form exceeds
    them. A tenth of the bores with five touches that are rough by three times the errors have
    residuals as small as of perfect ones: with all orders of the form alone alike, U covered 93 %
    of them (now 95 %), and was 25 % smaller for perfect ones.
    The residuals are normal for each size (restricted
    likelihood: the feature is projected off); their components along a family have its variance.

    Shapes that fill the residuals of few touches leave the same residuals as roughness: the size
    alone distinguishes them. Small residuals are taken as rough. Beyond 10 µm roughness becomes
    rare (with the fourth power of its size), and its probability goes to these shapes, except for
    that of one wrong touch, on a chip: it leaves such residuals, too, and moves the feature.
    """
    count, k = jacobian.shape
    dof = count - k
    if dof < 1:
        return _by_prior(families)
    basis = np.linalg.qr(jacobian)[0]
    observed = float(np.sum(residuals**2))
    # Errors that the feature takes up whole leave nothing, or less by rounding.
    noise = max(math.sqrt(max(expected, 0.0) / dof), 1e-9 * math.sqrt(observed / dof), 1e-12)
    tried = list(families) if count <= _MOST_TOUCHES else []
    spectra = [_Spectrum.of(each, basis, residuals) for each in tried]
    seen = [each.visible >= _VISIBLE for each in spectra]
    hidden = tuple(each.name for each, is_in in zip(tried, seen, strict=True) if not is_in)
    partly = (each for each, is_in in zip(tried, seen, strict=True) if is_in and each.in_parts)
    hidden += tuple(each.in_parts for each in partly if _least_visible(each, basis) < _VISIBLE)
    # Shapes of one size that fill the residuals are not distinguished from roughness. Those of a
    # correlation length are of many sizes.
    fills = [
        one.face is None and len(each.variances) > _MOST_FILLED * dof
        for one, each in zip(tried, spectra, strict=True)
    ]
    shown = [is_in and not full for is_in, full in zip(seen, fills, strict=True)]
    filling = [is_in and full for is_in, full in zip(seen, fills, strict=True)]
    compared = _Compared.of(tried, spectra, shown, filling, count)
    scatter = math.sqrt(observed / dof)
    least, largest = max(_LEAST * noise, _UNLIKELY * scatter), _MOST * max(noise, scatter)
    # Steps of equal ratio of noise and form together.
    whole = np.geomspace(noise**2 + least**2, noise**2 + largest**2, _SIZES)
    sizes = np.concatenate([[0.0], whole - noise**2])
    weights = _posterior(sizes, noise**2, (observed, dof), compared)
    found = weights > _SEEN * weights.max()
    family, rough, smooth = np.nonzero(found)
    share = weights[found] / weights[found].sum()
    none, roughness, shapes = np.zeros((0, count)), sizes[rough], sizes[smooth]
    form = FormOfPart(
        0.0, none, compared.factors, share, roughness, shapes, family, compared.shown, hidden
    )
    if observed <= expected * float(chdtri(dof, _RARE)) / dof:
        return form
    form = _in_uncertainty(form, observed - expected, dof, compared.spectra)
    names = tuple(each.name for each, full in zip(tried, filling, strict=True) if full)
    if not names or observed < _FAR_BEYOND**2 * expected:
        return form
    fewest = min(each.columns.shape[1] for each, full in zip(tried, filling, strict=True) if full)
    return replace(form, alike=names, telling=k + math.ceil(fewest / _MOST_FILLED))


def form_at_places(
    residuals: FloatArray,
    jacobian: FloatArray,
    expected: float,
    families: Sequence[Family],
    place: IntArray,
) -> FormOfPart:
    """As `form_of_part`, where some places were touched several times: each has one form.

    Parameters
    ----------
    residuals : (p,) float
        Means of the residuals at the places. [mm]
    jacobian : (p, k) float
        Of the feature, at the places.
    expected : float
        Sum of the squares of these means less a feature through them that the errors of the
        points produce, on average. [mm²]
    families : sequence of Family
        Shapes at the touches.
    place : (n,) int
        Of each touch.

    Returns
    -------
    FormOfPart
        Of the touches. More touches at the same places show no more of the form.
    """
    first = np.unique(place, return_index=True)[1]
    basis = np.linalg.qr(jacobian)[0]
    found = form_of_part(
        residuals - basis @ (basis.T @ residuals),
        jacobian,
        expected,
        [
            replace(
                each,
                columns=each.columns[first],
                face=None if each.face is None else each.face[first],
            )
            for each in families
        ],
    )
    return replace(
        found,
        smooth=found.smooth[:, place] if found.smooth.shape[0] else found.smooth,
        families=tuple(each[:, place] for each in found.families),
        place=place,
    )


def _by_prior(families: Sequence[Family]) -> FormOfPart:
    """The form that is usual, of all families together, or from touch to touch."""
    if not families:
        return FormOfPart(rough=UNSEEN, by_prior=True)
    whole = sum(each.share for each in families)
    smooth = [UNSEEN * math.sqrt(each.share / whole) * each.columns.T for each in families]
    return FormOfPart(smooth=_stacked(smooth), by_prior=True)


@dataclass(frozen=True, eq=False)
class _Spectrum:
    """A family in the residuals: variances of unit size, and squared components of what is seen."""

    variances: FloatArray
    squares: FloatArray
    visible: float

    @classmethod
    def of(cls, family: Family, basis: FloatArray, residuals: FloatArray) -> _Spectrum:
        columns = family.columns
        whole = max(_sum_of_squares(columns), 1e-300)
        least = 1e-6 * math.sqrt(whole)
        if family.face is not None and columns.shape[1] > MANY_SHAPES:
            return cls._of_faces(family, family.face, residuals, least)
        left = columns - basis @ (basis.T @ columns)
        u, size, _ = np.linalg.svd(left, full_matrices=False)
        kept: BoolArray = size > least
        seen = float(np.sum(left**2)) / whole
        return cls(size[kept] ** 2, (u[:, kept].T @ residuals) ** 2, seen)

    @classmethod
    def _of_faces(
        cls, family: Family, face: IntArray, residuals: FloatArray, least: float
    ) -> _Spectrum:
        """Face by face: the few numbers of a placement take next to nothing of so many shapes."""
        order = np.argsort(face, kind="stable")
        variances, squares = [], []
        for rows in np.split(order, np.flatnonzero(np.diff(face[order])) + 1):
            own = family.columns[rows]
            own = own if isinstance(own, np.ndarray) else own.toarray()
            u, size, _ = np.linalg.svd(own[:, np.any(own != 0.0, axis=0)], full_matrices=False)
            kept = size > least
            variances.append(size[kept] ** 2)
            squares.append((u[:, kept].T @ residuals[rows]) ** 2)
        return cls(np.concatenate(variances), np.concatenate(squares), 1.0)


def _least_visible(family: Family, basis: FloatArray) -> float:
    """Least share that the residuals show of a shape which the touches see at all."""
    u, size, _ = np.linalg.svd(family.columns, full_matrices=False)
    own = u[:, size > _SEEN_AT_ALL * size.max(initial=0.0)]
    left = own - basis @ (basis.T @ own)
    return float(np.linalg.svd(left, compute_uv=False).min(initial=1.0) ** 2)


_ROUGH_ALONE = _Spectrum(np.zeros(0), np.zeros(0), 1.0)


@dataclass(frozen=True, eq=False)
class _Compared:
    """Families that are compared: those that residuals show, then those that fill few residuals.

    `shares` are probabilities within each of both; of the first it is that of roughness, too.
    """

    spectra: tuple[_Spectrum, ...]
    factors: tuple[Shapes, ...]
    shares: FloatArray
    shown: int

    @classmethod
    def of(
        cls,
        tried: Sequence[Family],
        spectra: Sequence[_Spectrum],
        shown: Sequence[bool],
        filling: Sequence[bool],
        count: int,
    ) -> _Compared:
        chosen = [[i for i, is_in in enumerate(flags) if is_in] for flags in (shown, filling)]
        first = [spectra[i] for i in chosen[0]]
        factors = [tried[i].columns.T for i in chosen[0]]
        shares = [tried[i].share for i in chosen[0]]
        if not first:  # roughness alone
            first, factors, shares = [_ROUGH_ALONE], [np.zeros((1, count))], [1.0]
        more = [tried[i].share for i in chosen[1]]
        return cls(
            (*first, *(spectra[i] for i in chosen[1])),
            (*factors, *(tried[i].columns.T for i in chosen[1])),
            np.array([*np.divide(shares, sum(shares)), *np.divide(more, sum(more) or 1.0)]),
            len(first),
        )

    def prior(self, sizes: FloatArray, dof: int) -> FloatArray:
        """Probabilities of families, variances that are rough, and that are smooth, (j, s, s)."""
        count, found = len(sizes) - 1, []
        smooth = _SMOOTH if self.spectra[0] is not _ROUGH_ALONE else 0.0
        may_fill = len(self.spectra) > self.shown
        usual = np.ones(count)
        if may_fill:
            usual = _WRONG_TOUCH + (1.0 - _WRONG_TOUCH) / (1.0 + (sizes[1:] / _ROUGHEST**2) ** 2)
        for index, (spectrum, share) in enumerate(zip(self.spectra, self.shares, strict=True)):
            own = np.zeros((count + 1, count + 1))
            if index < self.shown:
                own[0, 0] = _PERFECT
                own[1:, 0] = (1.0 - _PERFECT) * (1.0 - smooth) / count * usual
                own[0, 1:] = (1.0 - _PERFECT) * smooth * (1.0 - _BOTH) / count
                own[1:, 1:] = (1.0 - _PERFECT) * smooth * _BOTH / count**2 * usual[:, None]
            else:
                large = sizes[1:] * float(spectrum.variances.sum()) / dof / _ROUGHEST**2
                beyond = (1.0 - _PERFECT) * (1.0 - smooth) / count * large**2 / (1.0 + large**2)
                beyond *= 1.0 - _WRONG_TOUCH
                own[0, 1:] = (1.0 - _BOTH) * beyond
                own[1:, 1:] = _BOTH / count * usual[:, None] * beyond
            found.append(share * own)
        return np.array(found)


def _posterior(
    sizes: FloatArray, noise: float, seen: tuple[float, int], compared: _Compared
) -> FloatArray:
    """Probabilities of families, variances that are rough, and that are smooth, (j, s, s)."""
    observed, dof = seen
    base = (noise + sizes)[:, None, None]
    found = []
    for spectrum in compared.spectra:
        total = base + sizes[None, :, None] * spectrum.variances
        rest = max(observed - float(spectrum.squares.sum()), 0.0)
        found.append(
            -0.5 * ((dof - len(spectrum.squares)) * np.log(base[..., 0]) + rest / base[..., 0])
            - 0.5 * np.sum(np.log(total) + spectrum.squares / total, axis=2)
        )
    likelihood = np.array(found)
    weights = compared.prior(sizes, dof) * np.exp(likelihood - likelihood.max())
    return np.asarray(weights / weights.sum())


def _in_uncertainty(
    form: FormOfPart, beyond: float, dof: int, spectra: Sequence[_Spectrum]
) -> FormOfPart:
    """With what the residuals show beyond the errors, in the shares of its likely shapes."""
    # Each size of roughness and shape together explains all that is beyond the errors.
    unit = np.array([float(spectrum.variances.sum()) for spectrum in spectra] or [0.0])
    shown = form.rough_variances * dof + form.smooth_variances * unit[form.family]
    share = beyond * form.weights / np.maximum(shown, 1e-300) * (shown > 0.0)
    share *= float(form.weights.sum()) / max(float(form.weights[shown > 0.0].sum()), 1e-300)
    rough = float(share @ form.rough_variances)
    each = np.bincount(form.family, share * form.smooth_variances, max(len(spectra), 1))
    smooth = [
        math.sqrt(size) * factors
        for size, factors in zip(each, form.families, strict=False)
        if size > 1e-6 * max(rough, float(each.max()))
    ]
    factors = _stacked(smooth) if smooth else form.smooth
    return replace(form, rough=math.sqrt(rough), smooth=factors)
