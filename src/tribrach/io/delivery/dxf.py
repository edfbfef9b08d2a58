"""A result as a drawing, DXF: layers by role and code, blocks with attributes, ellipses, moves.

Metres of the model; texts and symbols are as large as they print at the scale of the drawing. What
is too small to be seen, ellipses and displacements, is enlarged by the factor that its layer and
the legend name.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Sequence
from importlib import import_module
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.delivery.content import (
    CONFIDENCE,
    DeliveredMove,
    DeliveredPosition,
    Delivery,
    ellipse_of,
)

#: on paper [m]: height of texts, of a symbol, of a line of the legend, of ellipses and moves
_TEXT, _SYMBOL, _LINE, _SEEN = 2.5e-3, 2.0e-3, 5e-3, 8e-3
#: what a sheet A3 holds inside its margin [m]
_SHEET = (0.36, 0.25)
_SCALES = (1.0, 2.0, 2.5, 5.0)
#: colours by role, of the index of AutoCAD
_COLOURS = {
    "control": 5, "check": 6, "free": 7, "station": 30, "moved": 1, "stable": 3, "undecided": 8,
}  # fmt: skip
#: characters that names of layers may not have
_FORBIDDEN = re.compile(r"[<>/\\\":;?*|=`,\x00-\x1f]+")
#: decimals of attributes in metres and millimetres
_METRES, _MILLIMETRES = 4, 2


def write(delivery: Delivery, scale: float | None = None) -> bytes:
    """The drawing as the bytes of a DXF file; ``scale`` 500 for 1:500, a usual one if None."""
    ezdxf: Any = import_module("ezdxf")
    places = np.array([p.xyz[:2] for p in delivery.plan])
    printed = _usual(np.ptp(places, axis=0)) if scale is None else scale
    if not printed > 0:
        raise InputError(f"the scale is {printed:g}", cure="give its denominator, such as 500")
    # handles and dates that are the same for the same result
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        document = ezdxf.new("R2010", setup=True)
        _Drawing(document, delivery, printed / 1000).draw(places)
        stream = io.StringIO()
        document.write(stream)
        return bytes(document.encode(stream.getvalue()))
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before


def _usual(extent: Array) -> float:
    """The first usual scale at which an extent (2,) [m] fits a sheet A3."""
    wide, high = (float(v) for v in sorted(extent, reverse=True))
    needed = max(wide / _SHEET[0], high / _SHEET[1], 50.0)
    decade = 10.0 ** math.floor(math.log10(needed))
    return next(s * decade for s in (*_SCALES, 10.0) if s * decade >= needed * (1 - 1e-9))


def _enlargement(sizes: Sequence[float], seen: float) -> float:
    """The factor 1, 2 or 5 times a power of ten that makes the median size as large as ``seen``."""
    real = [size for size in sizes if size > 0]
    if not real:
        return 1.0
    wanted = max(seen / float(np.median(real)), 1.0)
    decade = 10.0 ** math.floor(math.log10(wanted))
    return max(s * decade for s in (1.0, 2.0, 5.0) if s * decade <= wanted * (1 + 1e-9))


class _Drawing:
    """A drawing that is being made; ``millimetre`` is one of the paper in the model [m]."""

    def __init__(self, document: Any, delivery: Delivery, millimetre: float) -> None:
        self.document, self.delivery, self.millimetre = document, delivery, millimetre
        self.space = document.modelspace()
        document.units = 6
        document.header["$MEASUREMENT"] = 1
        document.header["$LUNITS"], document.header["$LUPREC"] = 2, 4

    def draw(self, places: Array) -> None:
        """Everything; ``places`` (n, 2) are those of the points in plan."""
        low, high = places.min(axis=0), places.max(axis=0)
        for role in dict.fromkeys(p.role for p in self.delivery.plan):
            self._block(role)
        for a, b in self.delivery.lines:
            layer = self._layer("SIGHTS", 9)
            self.space.add_line(_xyz(a.xyz), _xyz(b.xyz), dxfattribs={"layer": layer})
        for position in self.delivery.plan:
            self._position(position)
        said = [*self._ellipses(), *self._moves()]
        self._legend(np.array([low[0], low[1]]), said)
        margin = 20 * self.millimetre
        self.document.header["$EXTMIN"] = (*(low - margin), 0.0)
        self.document.header["$EXTMAX"] = (*(high + margin), 0.0)
        middle, size = (low + high) / 2, np.ptp(places, axis=0) + 2 * margin
        self.document.set_modelspace_vport(
            height=float(max(size[1], size[0] / 1.6)), center=tuple(middle.tolist())
        )

    def _layer(self, name: str, colour: int) -> str:
        """A layer, made where it is not there."""
        clean = _FORBIDDEN.sub("_", name).strip()[:200]
        if clean not in self.document.layers:
            self.document.layers.add(clean, color=colour)
        return clean

    def _block(self, role: str) -> None:
        """The symbol of a role, one unit large, and the attributes of its points."""
        block = self.document.blocks.new(f"TRIBRACH_{role.upper()}")
        if role == "control":
            block.add_lwpolyline([(-0.5, -0.4), (0.5, -0.4), (0, 0.6)], close=True)
        elif role == "station":
            block.add_lwpolyline([(-0.5, 0), (0, -0.5), (0.5, 0), (0, 0.5)], close=True)
        elif role == "check":
            block.add_lwpolyline([(-0.4, -0.4), (0.4, -0.4), (0.4, 0.4), (-0.4, 0.4)], close=True)
        else:
            block.add_circle((0, 0), 0.4)
        block.add_point((0, 0))
        ratio = _TEXT / _SYMBOL
        lines = ("NAME", "HEIGHT", "CODE")
        hidden = ("ROLE", "EASTING", "NORTHING", "SIGMA_E_MM", "SIGMA_N_MM", "SIGMA_H_MM")
        for k, tag in enumerate((*lines, *hidden)):
            size = ratio if tag == "NAME" else 0.7 * ratio
            at = (0.9, 0.3 - 1.15 * ratio * min(k, len(lines)))
            made = block.add_attdef(tag, at, dxfattribs={"height": size, "style": "OpenSans"})
            made.is_invisible = tag in hidden

    def _position(self, position: DeliveredPosition) -> None:
        """A block with its attributes."""
        code = f" {position.code}" if position.code else ""
        colour = _COLOURS[position.role]
        layer = self._layer(f"POINTS {position.role.upper()}{code}", colour)
        size = 1e3 * _SYMBOL * self.millimetre
        reference = self.space.add_blockref(
            f"TRIBRACH_{position.role.upper()}",
            _xyz(position.xyz),
            dxfattribs={"layer": layer, "xscale": size, "yscale": size, "zscale": size},
        )
        e, n, h = (_figure(v, _METRES) for v in position.xyz)
        sigmas = (_figure(1e3 * v, _MILLIMETRES) for v in position.sigma)
        values = dict(zip(("SIGMA_E_MM", "SIGMA_N_MM", "SIGMA_H_MM"), sigmas, strict=True))
        reference.add_auto_attribs(
            {
                "NAME": _text(position.name),
                "HEIGHT": h,
                "CODE": _text(position.code),
                "ROLE": position.role,
                "EASTING": e,
                "NORTHING": n,
                **values,
            }
        )
        for attribute in reference.attribs:
            attribute.dxf.layer = layer

    def _ellipses(self) -> list[str]:
        """Confidence ellipses, and what the legend says of them."""
        seen = 1e3 * _SEEN / 2 * self.millimetre
        if moves := self._moved():
            factor = self._move_factor
            shapes = [(m.xyz + factor * m.vector, ellipse_of(m.covariance)) for m in moves]
        else:
            shapes = [(p.xyz, p.ellipse) for p in self.delivery.plan]
            factor = _enlargement([shape[0] for _, shape in shapes], seen)
        shapes = [(xyz, shape) for xyz, shape in shapes if shape[0] > 0]
        if not shapes:
            return []
        percent = round(100 * CONFIDENCE)
        layer = self._layer(f"ELLIPSES {percent}% x{factor:.0f}", 4)
        for xyz, (major, minor, azimuth) in shapes:
            axis = (factor * major * math.sin(azimuth), factor * major * math.cos(azimuth))
            self.space.add_ellipse(
                _xyz(xyz),
                major_axis=axis,
                ratio=min(max(minor / major, 1e-6), 1.0),
                dxfattribs={"layer": layer},
            )
        return [
            f"Ellipses hold with {percent} % and are enlarged {factor:.0f} times: "
            f"1 mm on paper is {1e3 * self.millimetre / factor:.3g} mm; sigmas are "
            f"{'a posteriori' if self.delivery.scale == 'posterior' else 'a priori'}."
        ]

    def _moved(self) -> list[DeliveredMove]:
        """Displacements of points that have a place in plan."""
        return [m for m in self.delivery.moves if np.isfinite(m.xyz[:2]).all()]

    @property
    def _move_factor(self) -> float:
        """Factor by which displacements are enlarged."""
        sizes = [float(np.hypot(*m.vector[:2])) for m in self._moved()]
        return _enlargement(sizes, 2e3 * _SEEN * self.millimetre)

    def _moves(self) -> list[str]:
        """Displacements with their heads, and what the legend says of them."""
        if not (moves := self._moved()):
            return []
        factor, size = self._move_factor, 1e3 * _SYMBOL * self.millimetre
        for move in moves:
            start, end = move.xyz, move.xyz + factor * move.vector
            colour = 1 if move.verdict == "moved" else 8
            layer = self._layer(f"DISPLACEMENTS {move.verdict.upper()} x{factor:.0f}", colour)
            given = {"layer": layer}
            self.space.add_line(_xyz(start), _xyz(end), dxfattribs=given)
            along = (end - start)[:2]
            if (length := float(np.hypot(*along))) > 0:
                along = along / length
                across = np.array([-along[1], along[0]])
                head = [end[:2], end[:2] - size * (along + 0.35 * across)]
                head.append(end[:2] - size * (along - 0.35 * across))
                corners = [(*p.tolist(), _xyz(end)[2]) for p in head]
                self.space.add_solid([*corners, corners[-1]], dxfattribs=given)
            if move.vector[2]:
                self.space.add_text(
                    f"dh {1e3 * move.vector[2]:+.1f} mm",
                    height=0.7e3 * _TEXT * self.millimetre,
                    dxfattribs={**given, "style": "OpenSans"},
                ).set_placement(_xyz(end + np.array([0.4 * size, -size, 0.0])))
        return [
            f"Displacements are enlarged {factor:.0f} times: 1 mm on paper is "
            f"{1e3 * self.millimetre / factor:.3g} mm."
        ]

    def _legend(self, corner: Array, said: Sequence[str]) -> None:
        """Title, scale, reference system and what is enlarged, below the points."""
        delivery, layer = self.delivery, self._layer("LEGEND", 7)
        system = ", ".join(filter(None, (delivery.crs or "local frame", delivery.heights)))
        at = f", epoch {delivery.epoch:g}" if delivery.epoch is not None else ""
        lines = [
            delivery.title,
            f"Scale 1:{1e3 * self.millimetre:g}. Coordinates: {system}{at}, metres.",
            *([delivery.datum] if delivery.datum else []),
            *said,
            f"{delivery.program}",
        ]
        for k, line in enumerate(lines):
            height = 1e3 * _TEXT * self.millimetre * (1.4 if k == 0 else 1.0)
            y = float(corner[1]) - (15 + 1e3 * _LINE * k) * self.millimetre
            self.space.add_text(
                _text(line), height=height, dxfattribs={"layer": layer, "style": "OpenSans"}
            ).set_placement((float(corner[0]), y))


def _xyz(xyz: Array) -> tuple[float, float, float]:
    """A place of the drawing; a height that is not known is zero."""
    e, n, h = (float(v) for v in xyz)
    return e, n, h if math.isfinite(h) else 0.0


def _figure(value: float, digits: int) -> str:
    """A number as an attribute, "" where there is none."""
    return f"{value:.{digits}f}" if math.isfinite(value) else ""


def _text(text: str) -> str:
    """A text whose signs a drawing does not take for codes."""
    plain = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return plain.replace("%%", "% %").replace("^", "^ ")
