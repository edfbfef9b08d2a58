"""Where the points of a STAR*NET job are, and the work frame that they are in.

A local job is flat, with curvature and refraction for zenith angles. A grid job is in the work
frame of its projection, where lengths, directions and heights need no reduction: scale,
convergence, arc-to-chord corrections and the curvature of the Earth are exact. Coordinates with
standard errors are observations; held ones are held.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError, RefusalCollector
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.projection import ProjectedGrid
from tribrach.geodesy.site import FlatSite
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.io.survey.starnet.records import Given, Sigma, SigmaMark, StarnetRecords
from tribrach.io.survey.starnet.settings import StarnetSettings
from tribrach.network.survey import Survey
from tribrach.observations.control import Coordinate, DirectedComponents, Heights

#: coordinates of a point written twice that differ by more are told [m]
_SAME = 1e-4


def grid_around(crs: str, plan: Array, height: float) -> ProjectedGrid:
    """The grid of a job, with the origin of the work frame in the middle of its points.

    ``plan`` (n, 2): easting and northing of the given points [m]; ``height``: mean ellipsoidal
    height [m].
    """
    easting, northing = plan.mean(axis=0).round(-1)
    return ProjectedGrid(crs, float(easting), float(northing), height)


class Places:
    """Points of a job in its work frame.

    ``refused``: gathers points that cannot be used; ``output``: converts it to the grid, None for a
    local job; ``given``: what is given of each point, by name; ``xyz``: approximate coordinates
    (3,) [m] in the work frame by name, NaN where not given; ``held``: names of points of which
    everything is held.
    """

    def __init__(
        self, records: StarnetRecords, settings: StarnetSettings, refused: RefusalCollector
    ) -> None:
        self.kind, self.settings = records.kind, settings
        self.warnings: list[str] = []
        self.given = self._joined(records.given)
        self.frame = self._frame()
        self.output: OutputFrame | None = None
        if self.frame.grid is not None:
            assert settings.crs is not None
            self.output = OutputFrame(self.frame, "projected", settings.crs)
        self.xyz: dict[str, Array] = {}
        for given in self.given.values():
            with refused.record():
                self.xyz[given.name] = self._place(given)
        self.held = {name for name, given in self.given.items() if self._holds(given)}

    def _joined(self, records: Sequence[Given]) -> dict[str, Given]:
        """One record for each point: plan and height may stand in different lines."""
        out: dict[str, Given] = {}
        for new in records:
            old = out.get(new.name)
            if old is None:
                out[new.name] = new
            elif new.east is None:
                height = (*old.sigmas[:2], new.sigmas[2])
                out[new.name] = replace(
                    old, height=new.height, sigmas=height, ellipsoidal=new.ellipsoidal
                )
            elif old.east is None and new.height is None:
                height = (*new.sigmas[:2], old.sigmas[2])
                out[new.name] = replace(new, height=old.height, sigmas=height)
            else:
                if _differ(old, new):
                    self.warnings.append(
                        f"{new.source}: point {new.name} has other coordinates than at "
                        f"{old.source}: those that stand later are used; keep one line"
                    )
                out[new.name] = new
        return out

    def _frame(self) -> WorkFrame:
        """The work frame: flat, or that of the grid around the middle of the points."""
        settings = self.settings
        if settings.crs is None or self.kind == "LEV":
            return WorkFrame(FlatSite(settings.radius if self.kind == "3D" else None))
        projected = np.array(
            [(g.east, g.north) for g in self.given.values() if g.east and not g.geographic],
            dtype=float,
        ).reshape(-1, 2)
        geographic = np.array(
            [(g.east, g.north) for g in self.given.values() if g.east and g.geographic],
            dtype=float,
        ).reshape(-1, 2)
        if len(geographic):
            anywhere = ProjectedGrid(settings.crs, 0.0, 0.0)
            longitude, latitude = geographic.mean(axis=0)
            plan = anywhere.plan(latitude, longitude)
            projected = np.concatenate([projected, plan[None]])
        if not len(projected):
            raise InputError(
                "no point has coordinates, and the job is in a grid",
                file=settings.source or None,
                cure="give at least one line C or P",
            )
        heights = [g.height for g in self.given.values() if g.height is not None]
        up = float(np.mean(heights)) if heights else settings.elevation
        grid = grid_around(settings.crs, projected, up + settings.geoid)
        return WorkFrame(grid.site, grid, settings.geoid)

    def _place(self, given: Given) -> Array:
        """Approximate coordinates (3,) of a point in the work frame."""
        told = given.height is not None or given.sigmas[2] is SigmaMark.FREE
        if self.kind != "2D" and not told:
            raise InputError(
                f"{given.name} has a standard error of its height, and no height",
                record=given.source,
                cure="give the height, or leave its standard error out",
            )
        if self.frame.grid is None:
            if given.geographic:
                raise InputError(
                    f"{given.name} has latitude and longitude, and the job is local",
                    record=given.source,
                    cure="give the project of the job, with its grid",
                )
            parts = (given.east, given.north, given.height)
            out = np.array([np.nan if part is None else part for part in parts])
            return np.where([True, True, self.kind != "2D"], out, 0.0)
        if given.east is None or given.north is None:
            return np.full(3, np.nan)
        height = self.elevation(given)
        if given.geographic:
            xyz, _ = self.frame.from_geodetic(np.array([[given.north, given.east, height]]))
        else:
            xyz, _ = self.frame.from_own(np.array([[given.east, given.north, height]]))
        place: Array = xyz[0]
        return place

    def elevation(self, given: Given) -> float:
        """Height of a point in the system of the job [m]."""
        if given.height is None or self.kind == "2D":
            assert self.frame.grid is not None
            level = self.frame.grid.height - self.settings.geoid
            return self.settings.elevation if self.kind == "2D" else level
        return given.height - (self.settings.geoid if given.ellipsoidal else 0.0)

    def _axes(self) -> tuple[int, ...]:
        """Axes that are adjusted."""
        return {"2D": (0, 1), "LEV": (2,)}.get(self.kind, (0, 1, 2))

    def _holds(self, given: Given) -> bool:
        """Is everything of a point held that the job adjusts?"""
        return all(given.sigmas[axis] is SigmaMark.FIXED for axis in self._axes())

    def line(self, pairs: Sequence[tuple[str, str]]) -> Array:
        """Horizontal length and height difference (n, 2) [m] of lines, NaN where not known."""
        nowhere = np.full(3, np.nan)
        start = np.array([self.xyz.get(a, nowhere) for a, _ in pairs]).reshape(-1, 3)
        end = np.array([self.xyz.get(b, nowhere) for _, b in pairs]).reshape(-1, 3)
        known = np.isfinite(start[:, :2]).all(axis=1) & np.isfinite(end[:, :2]).all(axis=1)
        up = np.isnan(start[:, 2]) | np.isnan(end[:, 2])
        start[up, 2] = end[up, 2] = 0.0
        out = np.full((len(pairs), 2), np.nan)
        u = np.einsum("nij,nj->ni", self.frame.site.axes(start[known]), end[known] - start[known])
        out[known] = np.stack([np.hypot(u[:, 0], u[:, 1]), u[:, 2]], axis=1)
        return out

    def convergence(self, start: str, end: str) -> float | None:
        """Azimuth less grid bearing [rad] of a line, None where no coordinates tell it.

        With both ends known the correction from arc to chord is in it; with one of them it is the
        convergence of the meridians there.
        """
        if self.output is None:
            return 0.0
        if (found := self._mapped(start, end)) is None:
            return None
        u, plan = found
        turned = np.arctan2(u[0], u[1]) - np.arctan2(plan[0], plan[1])
        return float(np.remainder(turned + np.pi, 2 * np.pi) - np.pi)

    def stretch(self, start: str, end: str) -> float | None:
        """Length of a line on the grid over its horizontal length, None where nothing tells it."""
        if self.output is None or (found := self._mapped(start, end)) is None:
            return None
        u, plan = found
        return float(np.hypot(*plan) / np.hypot(u[0], u[1]))

    def _mapped(self, start: str, end: str) -> tuple[Array, Array] | None:
        """A line in the local horizon (3,) and on the grid (2,) [m], None without coordinates.

        Without the other end a point 10 m to the north stands for it.
        """
        known = [n for n in (start, end) if n in self.xyz and np.isfinite(self.xyz[n]).all()]
        if not known or self.output is None:
            return None
        first = self.xyz[known[0]]
        axes = self.frame.site.axes(first[None])[0]
        second = self.xyz[known[1]] if len(known) == 2 else first + 10.0 * axes[1]
        plan = np.diff(self.output.from_work(np.stack([first, second])), axis=0)[0]
        return axes @ (second - first), plan[:2]

    def hold_heights(self, names: Sequence[str], warnings: list[str]) -> None:
        """Hold given heights that no observation determines."""
        held = []
        for name in names:
            given = self.given[name]
            if given.height is not None and given.sigmas[2] is SigmaMark.FREE:
                self.given[name] = replace(given, sigmas=(*given.sigmas[:2], SigmaMark.FIXED))
                held.append(name)
        if held:
            listed = ", ".join(held[:8]) + (f" and {len(held) - 8} more" if len(held) > 8 else "")
            one = len(held) == 1
            warnings.append(
                f"No zenith angle, level or vector tells the height of {listed}: "
                f"{'it is' if one else 'they are'} held at the given height{'' if one else 's'}."
            )
        self.held = {name for name, given in self.given.items() if self._holds(given)}

    def add_to(self, survey: Survey, names: set[str], but: set[str]) -> None:
        """Add the points, with what is known of them beforehand."""
        for given in self.given.values():
            if given.name in self.xyz and given.name not in but:
                self._add(survey, given)
        if self.kind == "2D" and self.frame.grid is not None:
            # a job in plan is at one height
            level = self.settings.elevation + self.settings.geoid
            flat = sorted(names - self.held - but)
            survey.add(
                Heights,
                values=np.full(len(flat), level),
                position=flat,
                hard=True,
                source=[self.settings.source] * len(flat),
            )

    def _add(self, survey: Survey, given: Given) -> None:
        """One point: held, weighted or free, each coordinate by itself."""
        xyz = self.xyz[given.name]
        axes = self._axes()
        sigmas = [given.sigmas[axis] if axis in axes else SigmaMark.FREE for axis in range(3)]
        weighted = [isinstance(sigma, float) for sigma in sigmas]
        held = given.name in self.held
        covariance = None
        if all(weighted) and self.frame.grid is not None:
            covariance = self._covariance(given)
        elif all(weighted):
            covariance = np.diag([float(s) ** 2 for s in sigmas if isinstance(s, float)])
        flat = self.frame.grid is None
        free = (
            np.array([s is not SigmaMark.FIXED for s in sigmas]) if flat else np.full(3, not held)
        )
        survey.point(
            given.name,
            xyz,
            free=free & ~np.array([axis not in axes for axis in range(3)]) if flat else free,
            role="control" if held or covariance is not None else "free",
            covariance=covariance,
            source=given.source,
        )
        if covariance is None and not held:
            for axis in axes:
                if isinstance(sigmas[axis], float) or (
                    sigmas[axis] is SigmaMark.FIXED and not flat
                ):
                    self._component(survey, given, axis, sigmas[axis])

    def _covariance(self, given: Given) -> Array:
        """Covariance (3, 3) [m^2] in the work frame of coordinates with standard errors."""
        variances = np.diag([float(s) ** 2 for s in given.sigmas if isinstance(s, float)])
        if given.geographic:
            place = np.array([[given.north, given.east, self.elevation(given)]], dtype=float)
            out = self.frame.from_geodetic(place, variances[None])[1]
        else:
            place = np.array([[given.east, given.north, self.elevation(given)]], dtype=float)
            out = self.frame.from_own(place, variances[None])[1]
        assert out is not None
        matrix: Array = out[0]
        return matrix

    def _component(self, survey: Survey, given: Given, axis: int, sigma: Sigma) -> None:
        """One coordinate as an observation, or as a condition if it is held."""
        hard = sigma is SigmaMark.FIXED
        common: dict[str, Any] = {"position": [given.name], "source": [given.source], "hard": hard}
        if not hard:
            common["sigma"] = sigma
        if self.frame.grid is None:
            value = (given.east, given.north, given.height)[axis]
            assert value is not None
            survey.add(Coordinate, values=[value], axis=np.array([axis]), **common)
            return
        if axis == 2:
            level = self.elevation(given) + self.settings.geoid
            survey.add(Heights, values=[level], **common)
            return
        assert self.output is not None
        xyz = self.xyz[given.name]
        if given.geographic:
            direction = self.frame.site.axes(xyz[None])[0][axis]
        else:
            gradient = self.output.jacobian(xyz)[axis]
            direction = gradient / np.linalg.norm(gradient)
        survey.add(
            DirectedComponents, values=[direction @ xyz], direction=direction[None], **common
        )


def _differ(old: Given, new: Given) -> bool:
    """Are coordinates that are written twice not the same?"""
    if old.geographic != new.geographic:
        return True
    pairs = ((old.east, new.east), (old.north, new.north), (old.height, new.height))
    scale = 1e7 if new.geographic else 1.0
    return any(
        a is not None and b is not None and abs(a - b) * (scale if k < 2 else 1.0) > _SAME
        for k, (a, b) in enumerate(pairs)
    )
