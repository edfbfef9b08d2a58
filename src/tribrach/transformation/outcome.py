"""A fit with everything that is said about it: tests, checks, scale, models, what was removed."""

from __future__ import annotations

from dataclasses import dataclass

from tribrach.distributions import chi2
from tribrach.transformation.axes import axis_sentences
from tribrach.transformation.fit import CommonPoints, Fit, fit_points
from tribrach.transformation.model_choice import Rung, ScaleTest, ladder, scale_test
from tribrach.transformation.models import Model
from tribrach.transformation.snooping import snoop_points
from tribrach.transformation.testing import CheckResult, PointTests, check_points, point_tests

__all__ = ["Outcome", "examine"]

#: significance of the global test and of single check points
ALPHA, CHECK = 0.05, 0.99


@dataclass(frozen=True, eq=False)
class Outcome:
    """A fit examined.

    odd : what looks wrong with the columns; steps : what snooping did; removed : the names.
    """

    fit: Fit
    tests: PointTests
    checks: CheckResult | None
    scale: ScaleTest | None
    rungs: tuple[Rung, ...]
    odd: tuple[str, ...]
    steps: tuple[str, ...]
    removed: tuple[str, ...]

    def sentences(self) -> list[str]:
        """Everything to be known, in words."""
        return [*self.odd, self.judgement(), *self.steps, *self._suspects(), *self._more()]

    def judgement(self) -> str:
        """The global test, or why there is none."""
        fit = self.fit
        if fit.dof <= 0:
            return "no redundancy: nothing is checked"
        if not fit.points.weighted:
            assert fit.sigma0 is not None
            return (
                f"no sigmas were given: one coordinate has sigma {1e3 * fit.sigma0:.2f} mm a "
                f"posteriori with redundancy {fit.dof}; all sigmas rest on it"
            )
        low, high = (float(chi2.ppf(p, fit.dof)) for p in (ALPHA / 2, 1 - ALPHA / 2))
        limits = f"{fit.vtpv:.2f} against {low:.2f} to {high:.2f}, redundancy {fit.dof}"
        if fit.vtpv > high:
            return (
                f"the global test fails ({limits}): wrong points, sigmas too small, or a model "
                "that is too stiff"
            )
        cautious = "; the sigmas look too large" if fit.vtpv < low else ""
        return f"the global test passes ({limits}){cautious}"

    def _suspects(self) -> list[str]:
        names = [
            n for n, used in zip(self.fit.points.names, self.fit.points.used, strict=True) if used
        ]
        found = [n for n, bad in zip(names, self.tests.suspicious, strict=True) if bad]
        if not found:
            return []
        return [f"does not fit: {', '.join(found)} (snooping takes the worst out first)"]

    def _more(self) -> list[str]:
        out = []
        if self.scale is not None:
            rigid, scaled = (6, 7) if self.fit.points.dimension == 3 else (3, 4)
            out.append(self.scale.sentence(rigid, scaled))
        if self.checks is not None:
            bad = self.checks.statistic > self.checks.limit(CHECK)
            names = [self.fit.points.names[k] for k in self.checks.place[bad]]
            size = " ".join(f"{1e3 * v:.2f}" for v in self.checks.rmse)
            end = f"; beyond their 99 % limit: {', '.join(names)}" if names else ""
            out.append(f"RMSE of check points ({len(bad)}), x y z: {size} mm{end}")
        elif self.fit.dof > 0:
            out.append(
                f"the RMS of the fit, {1e3 * self.fit.rms:.2f} mm, is no accuracy: hold points out "
                "as check points"
            )
        return out


def examine(points: CommonPoints, model: Model, titles: tuple[str, ...], *, snoop: bool) -> Outcome:
    """Fit, look at the axes, test, snoop if wished.

    Raises
    ------
    InputError : too few points; AdjustmentError : parameters left open.
    """
    used = points.used
    odd = tuple(axis_sentences(points.a[used], points.b[used], model, titles))
    fit = fit_points(points, model)
    steps: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    # exchanged columns make every point suspicious
    if snoop and not odd:
        found = snoop_points(fit)
        fit, steps, removed = found.fit, found.steps, found.removed
    return Outcome(
        fit,
        point_tests(fit),
        check_points(fit),
        scale_test(fit.points),
        tuple(ladder(fit.points)),
        odd,
        steps,
        removed,
    )
