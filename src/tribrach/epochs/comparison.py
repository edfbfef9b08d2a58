"""Two epochs compared: which points moved, by how much, how sure, and what would have been seen.

The steps are those of the classical analysis: the reference points are tested for congruence, those
that moved are found, the datum is laid over the others, and every point is tested in it (method
sections 12.2 to 12.5).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array
from tribrach.answers import Matrix, Number, Result, Vector
from tribrach.epochs.congruence import (
    LIKELIHOOD,
    Congruence,
    CongruenceTest,
    Limits,
    StabilitySearch,
    search_moved,
)
from tribrach.epochs.differences import MOTIONS, Difference, motion_columns, motion_length
from tribrach.epochs.systematics import Answer, answer, quadratic_range
from tribrach.errors import AdjustmentError, InputError
from tribrach.network.quality import GlobalTest
from tribrach.network.significance import sidak
from tribrach.statistics import f

#: variance, in units of that of the other coordinates, of a coordinate that both epochs hold
_EXACT = 1e-8
#: probability by chance below which a scale between epochs is taken for one
_SCALE = 1e-3


@dataclass(frozen=True)
class Settings:
    """Settings of a comparison of epochs."""

    #: names of the points that are taken as stable until a test says otherwise; all if empty
    references: tuple[str, ...] = ()
    confidence: float = 0.95  #: one minus the probability of a false alarm of each test
    power: float = 0.8  #: probability with which a minimal detectable displacement is found
    #: variances are scaled by the a-posteriori factor of both epochs, and tests are those of F
    posterior: bool = False
    #: the tests of single points have the confidence together, after Šidák, not each
    together: bool = False
    most: int | None = None  #: reference points that may have moved; the smaller half if None
    #: bounds of what may be systematic in a difference in E, N and U [m]
    systematic: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        """Refuse settings that are not probabilities or bounds."""
        for name in ("confidence", "power"):
            if not 0 < getattr(self, name) < 1:
                raise InputError(
                    f"{name} is {getattr(self, name):g}, which is not between 0 and 1",
                    cure="give a probability such as 0.95",
                )
        if any(not b >= 0 for b in self.systematic):
            raise InputError("a bound of systematic effects is negative", cure="give its size")


@dataclass(frozen=True, eq=False)
class Displacement(
    Result,
    without=("name",),
    keys={
        "vector": "displacement",
        "statistic": "test",
        "least": "test_least",
        "largest": "test_largest",
        "answer": "verdict",
        "easiest": "detectable_easiest",
    },
):
    """Displacement of a point in the datum of the stable points, with its test."""

    reference: bool  #: was it taken as stable?
    xyz: Vector  #: E, N, U at the first epoch [m]
    vector: Vector  #: along the axes of the comparison [m]
    covariance: Matrix  #: of the displacement, scaled as the tests are [m^2]
    #: ``T = v^T C^-1 v``, its limit, and the probability of a larger one by chance
    statistic: Number
    limit: float
    significance: Number
    #: with the systematic part that explains most of it, and with the one that explains least
    least: Number
    largest: Number
    answer: Answer
    #: displacement found with the stated power in the direction in which that is hardest, and in
    #: the easiest [m]
    detectable: Number
    easiest: Number
    name: str = ""

    @property
    def length(self) -> float:
        """Length of the displacement [m]."""
        return float(np.linalg.norm(self.vector))


@dataclass(frozen=True)
class CommonMotion(Result, keys={"statistic": "test"}):
    """A motion of the whole that was taken out although the networks do not leave it open."""

    name: str
    #: in metres, radians or 1
    value: float
    sigma: float
    #: value over sigma, and its limit
    statistic: float
    limit: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Everything that two epochs tell."""

    difference: Difference  #: what was compared
    #: how
    settings: Settings
    limits: Limits
    #: test of the reference points, and those of them that moved; None with too few of them
    search: StabilitySearch | None
    displacements: tuple[Displacement, ...]  #: of all points, in the order of the difference
    stable: tuple[str, ...]  #: names of the points that carry the datum
    #: by the names of the points that moved: groups that explain it nearly as well
    partners: tuple[tuple[str, ...], ...]
    #: the global test of the adjustment of each epoch; without redundancy where it is not known
    own: tuple[GlobalTest, GlobalTest]
    #: test of the variance factors of both epochs against each other; None where not known
    precision: CongruenceTest | None
    common: tuple[CommonMotion, ...]  #: motions that were taken out by choice, with their size
    whole: CongruenceTest  #: congruence test of all points together
    held: tuple[str, ...]  #: points that are held in both epochs: they are the datum

    @property
    def moved(self) -> tuple[str, ...]:
        """Names of the points that moved."""
        return tuple(d.name for d in self.displacements if d.answer == "moved")


def compare(
    difference: Difference, settings: Settings | None = None, chosen: Collection[str] = ()
) -> Comparison:
    """Test which points moved between two epochs (method sections 12.2 to 12.5)."""
    settings = settings or Settings()
    difference, held = _without_held(difference)
    names = difference.names
    strange = [n for n in settings.references if n not in names and n not in held]
    if strange:
        raise InputError(
            f"the reference point {strange[0]} is not in both epochs",
            cure=f"name points such as {', '.join(names[:6])}",
        )
    limits = _limits(difference, settings)
    # points that are held in both epochs are the datum, unless others are named
    every = not settings.references and not held
    among = [k for k, n in enumerate(names) if every or n in settings.references]
    form = _form(difference, range(len(names)))
    found, part = None, None
    stable = list(among)
    if among:
        part = _form(difference, among)
        if part.dof > 0:
            found = search_moved(part, limits, most=settings.most)
            stable = [k for i, k in enumerate(among) if i not in set(found.moved)]
    elif not held:
        raise AdjustmentError("no reference point carries the datum", ["name some of the points"])
    if difference.motions and not _carries(difference, stable):
        raise _without_datum(difference, [names[k] for k in stable], chosen)
    values, covariance = s_transformation(difference, stable)
    displacements = _displacements(
        difference, values, covariance * limits.factor, set(among), limits, settings
    )
    if found is not None and part is not None:
        displacements = _settled(
            displacements, found, among, part, difference.axes, limits, settings
        )
    partners = (
        ()
        if found is None
        else tuple(tuple(names[among[k]] for k in p.points) for p in found.partners)
    )
    return Comparison(
        difference=difference,
        settings=settings,
        limits=limits,
        search=found,
        displacements=displacements,
        stable=tuple(names[k] for k in stable) or held,
        partners=partners,
        own=_own(difference, settings),
        precision=_precision(difference, settings),
        common=_common(difference, stable, limits, chosen),
        whole=form.test(limits),
        held=held,
    )


def with_common_scale(found: Comparison, chosen: Collection[str] = ()) -> Comparison | None:
    """The comparison with a scale between the epochs, where that explains what moved as well.

    None where nothing has to be explained, where the networks leave the scale open, or where a
    scale explains less than points that moved.

    Method section 12.3.
    """
    motions, search = found.difference.motions, found.search
    if "scale" in motions or search is None or search.before.passed:
        return None
    scaled = tuple(m for m in MOTIONS if m in motions or m == "scale")
    try:
        other = compare(
            replace(found.difference, motions=scaled), found.settings, (*chosen, "scale")
        )
    except AdjustmentError:
        return None
    scale = next((m for m in other.common if m.name == "scale"), None)
    if scale is None or other.search is None or not other.search.resolved:
        return None
    if scale.statistic**2 < found.limits.limit(1, _SCALE):
        return None
    before, after = (len(s.moved) if s.resolved else np.inf for s in (search, other.search))
    if other.search.before.passed:
        # one number in the place of a point's coordinates: it has to explain nearly as much
        as_well = other.search.before.significance > search.after.significance / LIKELIHOOD
        return other if as_well or before > 1 else None
    return other if after + 1 < before else None


def _without_held(difference: Difference) -> tuple[Difference, tuple[str, ...]]:
    """The differences of points that are not held in both epochs, and the names of those.

    A point that is held along one axis alone is compared along the others: what both epochs hold
    alike cannot differ there, to what coordinates are exact to.
    """
    width = len(difference.axes)
    variance = np.diag(difference.covariance).reshape(-1, width)
    held = (variance <= 0).min(axis=1)
    alone = (variance <= 0) & ~held[:, None]
    if alone.any():
        exact = np.where(alone, _EXACT * np.median(variance[variance > 0]), 0.0)
        difference = replace(difference, covariance=difference.covariance + np.diag(exact.ravel()))
    if not held.any():
        return difference, ()
    keep = np.flatnonzero(~held)
    if not len(keep):
        raise AdjustmentError("all points are held in both epochs", ["none of them can be tested"])
    rows = difference.rows(keep)
    names = tuple(difference.names[k] for k in keep)
    left = replace(
        difference,
        names=names,
        xyz=difference.xyz[keep],
        values=difference.values[keep],
        covariance=difference.covariance[np.ix_(rows, rows)],
    )
    return left, tuple(n for k, n in enumerate(difference.names) if held[k])


def _limits(difference: Difference, settings: Settings) -> Limits:
    alpha = 1 - settings.confidence
    if not settings.posterior:
        return Limits(alpha)
    if difference.dof <= 0:
        raise InputError(
            "variances cannot be scaled a posteriori: the redundancy of both epochs is not known",
            cure="compare a priori, or give adjusted networks",
        )
    return Limits(alpha, difference.factor, difference.dof)


def _form(difference: Difference, points: Collection[int]) -> Congruence:
    """The quadratic form of some of the points."""
    chosen = np.array(list(points), dtype=np.int64)
    rows = difference.rows(chosen)
    return Congruence(
        difference.values[chosen].ravel(),
        difference.covariance[np.ix_(rows, rows)],
        difference.basis[rows],
        len(difference.axes),
        [difference.names[k] for k in chosen],
    )


def _carries(difference: Difference, stable: list[int]) -> bool:
    """Do these points fix all motions?"""
    basis = difference.basis
    if not len(stable):
        return not basis.shape[1]
    part = basis[difference.rows(stable)]
    value = np.linalg.svd(part, compute_uv=False)
    return len(value) >= basis.shape[1] and bool(value[-1] > 1e-6 * value[0])


def _without_datum(
    difference: Difference, stable: Sequence[str], chosen: Collection[str]
) -> AdjustmentError:
    """That points which did not move cannot carry the motions, why, and what would."""
    if not stable:
        headline = "no reference point is left to fix the datum"
    elif len(stable) == 1:
        headline = f"the point {stable[0]} alone does not fix the datum"
    else:
        headline = f"the points {', '.join(stable)} do not fix the datum"
    motions = [m for m in MOTIONS if m in difference.motions]
    turns = sum("rotation" in m for m in motions)
    # a point carries shifts, a second one turn and scale, a third the turns about both
    least = 3 if turns > 1 else 2 if turns or "scale" in motions else 1
    why = f"at least {least} points that stayed are needed to take out {_in_words(motions)}"
    if len(stable) >= least:
        why += ", and these lie in one line or one place"
    cure = "observe or name more reference points"
    return AdjustmentError(
        headline, [f"{why}: {cure}" + ", or take out fewer motions" * bool(chosen)]
    )


def _in_words(motions: Sequence[str]) -> str:
    """Motions with those of one sort together: shift in E, N and rotation about U."""
    sorts: dict[str, list[str]] = {}
    for motion in motions:
        sort, _, axis = motion.rpartition(" ")
        sorts.setdefault(sort, []).append(axis)
    return " and ".join(f"{sort} {', '.join(axes)}".strip() for sort, axes in sorts.items())


def s_transformation(difference: Difference, stable: list[int]) -> tuple[Array, Array]:
    """Differences (n, d) and their covariance in the datum of some points.

    ``S = I - G (G_s^T G_s)^-1 G_s^T E_s`` with the rows of the stable points (method section 12.3).
    """
    basis = difference.basis
    k = len(basis)
    if not basis.shape[1]:
        return difference.values, difference.covariance
    rows = difference.rows(stable)
    chosen = np.zeros((basis.shape[1], k))
    chosen[:, rows] = np.linalg.pinv(basis[rows])
    s = np.eye(k) - basis @ chosen
    values = (s @ difference.values.ravel()).reshape(difference.values.shape)
    return values, s @ difference.covariance @ s.T


def _displacements(
    difference: Difference,
    values: Array,
    covariance: Array,
    references: set[int],
    limits: Limits,
    settings: Settings,
) -> tuple[Displacement, ...]:
    """Every point in the datum of the stable ones, tested by itself."""
    width = len(difference.axes)
    n = len(difference.names)
    alpha = sidak(limits.alpha, n) if settings.together else limits.alpha
    limit = limits.limit(width, alpha)
    root = np.sqrt(limits.noncentrality(width, settings.power, alpha))
    bounds = np.array(settings.systematic)[list(difference.axes)]
    out = []
    for k, name in enumerate(difference.names):
        rows = difference.rows([k])
        c = covariance[np.ix_(rows, rows)]
        value = np.linalg.eigvalsh(c)
        vector = values[k]
        if value[0] <= 1e-12 * max(value[-1], 1e-300):
            # a point that alone carries a motion has no displacement in this datum
            statistic = least = largest = float("nan")
        else:
            statistic = float(vector @ np.linalg.solve(c, vector))
            least, largest = quadratic_range(vector, c, bounds)
        known = np.isfinite(statistic)
        out.append(
            Displacement(
                name=name,
                reference=k in references,
                xyz=difference.xyz[k],
                vector=vector,
                covariance=c,
                statistic=statistic,
                limit=limit,
                significance=limits.significance(statistic, width) if known else float("nan"),
                least=least,
                largest=largest,
                answer=answer(least, largest, limit) if known else "cannot tell",
                detectable=float(root * np.sqrt(max(value[-1], 0.0))),
                easiest=float(root * np.sqrt(max(value[0], 0.0))),
            )
        )
    return tuple(out)


def _settled(
    displacements: tuple[Displacement, ...],
    found: StabilitySearch,
    among: list[int],
    form: Congruence,
    axes: tuple[int, ...],
    limits: Limits,
    settings: Settings,
) -> tuple[Displacement, ...]:
    """Reference points by their common test: what passed it together did not move.

    Where no group of them explains the differences nothing is known to be stable, and no point
    is told to have moved or not. What of the displacements of reference points would have been
    detected is that of the global test, which has to be failed before any of them is looked at.
    """
    moved = {among[i] for i in found.moved}
    width = form.width
    root = np.sqrt(limits.noncentrality(form.dof, settings.power) * limits.factor)
    out = list(displacements)
    if not found.resolved:
        out = [replace(one, answer="cannot tell") for one in out]
    # without open motions no datum is chosen, and a displacement is what was measured
    if found.resolved and found.moved and form.rank:
        _estimated(out, found, among, form, axes, limits, settings)
    for i, k in enumerate(among):
        one = out[k]
        if k in moved and found.resolved:
            # what is systematic may still explain it
            said: Answer = "moved" if one.least >= one.limit else "cannot tell"
        elif not found.resolved:
            said = "cannot tell"
        else:
            # none is larger than what passed the test of all of them together
            one = replace(one, limit=found.after.limit)
            said = "cannot tell" if one.statistic > one.limit else "not moved"
        rows = slice(i * width, (i + 1) * width)
        value = np.linalg.eigvalsh(form.weights[rows, rows])
        seen = value[0] > 1e-12 * max(value[-1], 1e-300)
        out[k] = replace(
            one,
            answer=said,
            detectable=float(root / np.sqrt(value[0])) if seen else float("inf"),
            easiest=float(root / np.sqrt(value[-1])),
        )
    return tuple(out)


def _estimated(
    out: list[Displacement],
    found: StabilitySearch,
    among: list[int],
    form: Congruence,
    axes: tuple[int, ...],
    limits: Limits,
    settings: Settings,
) -> None:
    """Reference points that moved, by the best estimate beside all that stayed (section 12.3).

    Where some of these are worse than others, a datum that counts them alike tells less.
    """
    values, covariance = form.displacement(found.moved)
    width, bounds = form.width, np.array(settings.systematic)[list(axes)]
    for place, i in enumerate(found.moved):
        one = out[among[i]]
        rows = slice(place * width, (place + 1) * width)
        vector, c = values[rows], covariance[rows, rows] * limits.factor
        statistic = float(vector @ np.linalg.solve(c, vector))
        least, largest = quadratic_range(vector, c, bounds)
        out[among[i]] = replace(
            one,
            vector=vector,
            covariance=c,
            statistic=statistic,
            significance=limits.significance(statistic, width),
            least=least,
            largest=largest,
        )


def _own(difference: Difference, settings: Settings) -> tuple[GlobalTest, GlobalTest]:
    """The global test of each epoch by itself."""
    one, two = (
        GlobalTest.of(dof * factor if dof > 0 else 0.0, dof, 1 - settings.confidence)
        for dof, factor in zip(difference.dofs, difference.factors, strict=True)
    )
    return one, two


def _precision(difference: Difference, settings: Settings) -> CongruenceTest | None:
    """Are both epochs equally precise? The ratio of their variance factors, the larger above."""
    one, two = zip(difference.factors, difference.dofs, strict=True)
    if min(one[1], two[1]) <= 0 or not min(one[0], two[0]) > 0:
        return None
    above, below = (one, two) if one[0] >= two[0] else (two, one)
    ratio = above[0] / below[0]
    alpha = 1 - settings.confidence
    limit = float(f.ppf(1 - alpha / 2, above[1], below[1]))
    return CongruenceTest(ratio, above[1], limit, float(2 * f.sf(ratio, above[1], below[1])))


def _common(
    difference: Difference, stable: list[int], limits: Limits, chosen: Collection[str]
) -> tuple[CommonMotion, ...]:
    """Size of the motions that were taken out by choice, from the stable points."""
    motions = [m for m in difference.motions if m in chosen]
    if not motions or not stable:
        return ()
    rows = difference.rows(stable)
    covariance = difference.covariance[np.ix_(rows, rows)]
    every = list(difference.motions)
    basis = motion_columns(difference.xyz, difference.axes, every)[rows]
    if basis.shape[1] != len(every):
        return ()
    # what the networks leave open has no variance of its own
    open_ = basis[:, [k for k, m in enumerate(every) if m not in motions]]
    total = covariance + float(np.median(np.diag(covariance))) * (open_ @ open_.T)
    weighted = np.linalg.solve(total, basis)
    inverse = np.linalg.pinv(basis.T @ weighted, hermitian=True)
    estimate = inverse @ weighted.T @ difference.values[stable].ravel()
    sigma = np.sqrt(np.maximum(np.diag(inverse), 0.0) * limits.factor)
    limit = float(np.sqrt(limits.limit(1)))
    out = []
    for m in motions:
        k, unit = every.index(m), motion_length(difference.xyz, difference.axes, m)
        test = float(estimate[k] / sigma[k])
        out.append(CommonMotion(m, float(estimate[k]) / unit, float(sigma[k]) / unit, test, limit))
    return tuple(out)
