"""Write the same small GNSS network as DynaML and as DNA text, independently of the readers."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

AXES = "XYZ"


@dataclass
class Station:
    """A station line: three texts of coordinates."""

    name: str
    values: Sequence[str]
    constraints: str = "FFF"
    type: str = "XYZ"
    zone: str = ""


@dataclass
class Gnss:
    """A measurement G, X or Y: names of (first, second), texts of values, covariance (3n, 3n)."""

    type: str
    names: Sequence[tuple[str, str]]
    values: Sequence[Sequence[str]]
    covariance: np.ndarray
    scales: tuple[float, float, float, float] = (1, 1, 1, 1)
    frame: str = "GDA2020"
    epoch: str = "01.01.2020"
    coordinates: str = "XYZ"
    ignored: bool = False


@dataclass
class Line:
    """A measurement on one line: (degrees, minutes, seconds), packed degrees, or metres."""

    type: str
    names: Sequence[str]
    value: tuple[int, int, float] | str | float
    sigma: float
    heights: tuple[float, float] = (0.0, 0.0)
    ignored: bool = False


@dataclass
class Directions:
    """A set: instrument, then (target, (degrees, minutes, seconds)) and one sigma."""

    first: str
    rays: Sequence[tuple[str, tuple[int, int, float]]]
    sigma: float


@dataclass
class Network:
    """Stations and measurements with their file defaults."""

    stations: list[Station] = field(default_factory=list)
    measurements: list[Gnss | Line | Directions] = field(default_factory=list)
    frame: str = "GDA2020"
    epoch: str = "01.01.2020"


def baseline(first: str, second: str, vector: np.ndarray, covariance: np.ndarray, **more) -> Gnss:
    """A single baseline."""
    return Gnss("G", [(first, second)], [[f"{v:.4f}" for v in vector]], covariance, **more)


def write_dna(network: Network, folder: Path) -> list[Path]:
    """Two files in DNA 3.01."""
    head = "!#=DNA 3.01 {}    01.01.2021" + f"{network.frame:>14}{network.epoch:>14}{9:>10}"
    stations = [head.format("STN"), "* a comment"]
    for s in network.stations:
        x, y, z = s.values
        stations.append(
            f"{s.name:<20}{s.constraints} {s.type:<3}{x:>20}{y:>20}{z:>20}{s.zone:<3} text"
        )
    lines = [head.format("MSR")]
    for m in network.measurements:
        lines += {Gnss: _dna_gnss, Line: _dna_line, Directions: _dna_set}[type(m)](m)
    paths = [folder / "net.stn", folder / "net.msr"]
    for path, text in zip(paths, (stations, lines), strict=True):
        path.write_text("\r\n".join(text) + "\r\n")
    return paths


def _dna_gnss(m: Gnss) -> list[str]:
    star, n, out = "*" if m.ignored else " ", len(m.names), []
    for k, ((first, second), values) in enumerate(zip(m.names, m.values, strict=True)):
        count = "" if m.type == "G" else str(n)
        if m.type == "Y":
            second = m.coordinates if k == 0 else ""
        head = f"{m.type}{star}{first:<20}{second:<20}"
        if k == 0:
            head += f"{count:<20}" + "".join(f"{s:>10.2f}" for s in m.scales)
            head += f"{m.frame:>20}{m.epoch:>20}"
        out.append(head)
        c = m.covariance[3 * k : 3 * k + 3]
        for i in range(3):
            own = "".join(f"{c[i, 3 * k + j]:>20.13e}" for j in range(i + 1))
            out.append(f" {star}".ljust(62) + f"{values[i]:>20}" + own)
        for other in range(k + 1, n):
            for i in range(3):
                row = "".join(f"{v:>20.13e}" for v in c[i, 3 * other : 3 * other + 3])
                out.append(f" {star}".ljust(82) + row)
    return out


def _dna_line(m: Line) -> list[str]:
    names = "".join(f"{name:<20}" for name in m.names)
    text = f"{m.type}{'*' if m.ignored else ' '}{names:<60}{_dna_value(m.value)}{m.sigma:>9.3f}"
    return [text + "".join(f"{h:>7.3f}" for h in m.heights)]


def _dna_set(m: Directions) -> list[str]:
    out = []
    for k, (target, angle) in enumerate(m.rays):
        first, second, third = (
            (m.first, target, str(len(m.rays) - 1)) if k == 0 else ("", "", target)
        )
        out.append(f"D {first:<20}{second:<20}{third:<20}{_dna_value(angle)}{m.sigma:>9.3f}")
    return out


def _dna_value(value: tuple[int, int, float] | str | float) -> str:
    if isinstance(value, str):
        return f"{value:>14}".ljust(28)
    if isinstance(value, tuple):
        d, m, s = value
        return f"{d:>17} {m:02d} {s:07.4f}"
    return f"{value:>14.4f}".ljust(28)


def write_xml(network: Network, folder: Path) -> list[Path]:
    """Two files in DynaML."""
    head = (
        '<?xml version="1.0"?>\n<DnaXmlFormat type="{} File" '
        f'referenceframe="{network.frame}" epoch="{network.epoch}">\n'
    )
    stations = [head.format("Station"), "<!-- a comment -->"]
    for s in network.stations:
        x, y, z = s.values
        stations.append(
            f"<DnaStation><Name>{s.name}</Name><Constraints>{s.constraints}</Constraints>"
            f"<Type>{s.type}</Type>\n<StationCoord><Name>{s.name}</Name><XAxis>{x}</XAxis>"
            f"<YAxis>{y}</YAxis><Height>{z}</Height>"
            f"<HemisphereZone>{s.zone}</HemisphereZone></StationCoord></DnaStation>"
        )
    lines = [head.format("Measurement")]
    for m in network.measurements:
        lines += {Gnss: _xml_gnss, Line: _xml_line, Directions: _xml_set}[type(m)](m)
    paths = [folder / "netstn.xml", folder / "netmsr.xml"]
    for path, text in zip(paths, (stations, lines), strict=True):
        path.write_text("\n".join([*text, "</DnaXmlFormat>"]) + "\n")
    return paths


def write_jsonl(network: Network, folder: Path) -> list[Path]:
    """Two files of JSON lines, as DynAdjust converts DynaML: numbers where a double holds them."""
    out = []
    for path in write_xml(network, folder):
        root = ElementTree.fromstring(path.read_text())
        lines = [json.dumps({root.tag: root.attrib})]
        for one in root:
            record: dict[str, Any] = {"Source": ""}
            ends: dict[str, str] = {}
            for child in one:
                if child.tag in ("First", "Second"):
                    ends[child.tag] = child.text or ""
                if child.tag in ("GPSBaseline", "Clusterpoint", "Directions"):
                    entry = _json(child) | (ends if one.findtext("Type") in ("X", "Y") else {})
                    record.setdefault(child.tag, []).append(entry)
                else:
                    record.setdefault(child.tag, _json(child))
            lines.append(json.dumps({one.tag: record}))
        out.append(path.with_suffix(".jsonl"))
        out[-1].write_text("\n".join(lines) + "\n")
    return out


#: what stays text though it may look like a number
_TEXTS = ("Name", "First", "Second", "Third", "Target", "Epoch", "HemisphereZone")


def _json(element: ElementTree.Element) -> Any:
    """A number, a text, or an object with a list of covariances."""
    if not len(element):
        text = element.text or ""
        if element.tag in _TEXTS:
            return text
        try:
            return int(text) if element.tag == "Total" else float(text)
        except ValueError:
            return text
    out: dict[str, Any] = {}
    for child in element:
        if child.tag.endswith("Covariance"):
            out.setdefault(child.tag, []).append(_json(child))
        else:
            out[child.tag] = _json(child)
    return out


def _xml_gnss(m: Gnss) -> list[str]:
    v, p, lam, h = m.scales
    out = [
        f"<DnaMeasurement><Type>{m.type}</Type><Ignore>{'*' if m.ignored else ''}</Ignore>",
        f"<ReferenceFrame>{m.frame}</ReferenceFrame><Epoch>{m.epoch}</Epoch>",
        f"<Vscale>{v}</Vscale><Pscale>{p}</Pscale><Lscale>{lam}</Lscale><Hscale>{h}</Hscale>",
    ]
    if m.type == "Y":
        out.append(f"<Coords>{m.coordinates}</Coords>")
    if m.type != "G":
        out.append(f"<Total>{len(m.names)}</Total>")
    tag, cov = ("Clusterpoint", "Point") if m.type == "Y" else ("GPSBaseline", "GPS")
    for k, ((first, second), values) in enumerate(zip(m.names, m.values, strict=True)):
        out.append(f"<First>{first}</First>")
        if m.type != "Y":
            out.append(f"<Second>{second}</Second>")
        c = m.covariance[3 * k : 3 * k + 3]
        out.append(
            f"<{tag}>" + "".join(f"<{a}>{t}</{a}>" for a, t in zip(AXES, values, strict=True))
        )
        for i in range(3):
            for j in range(i, 3):
                name = f"Sigma{AXES[i]}{AXES[j]}"
                out.append(f"<{name}>{c[i, 3 * k + j]:.13e}</{name}>")
        for other in range(k + 1, len(m.names)):
            block = c[:, 3 * other : 3 * other + 3]
            cells = "".join(
                f"<m{i + 1}{j + 1}>{block[i, j]:.13e}</m{i + 1}{j + 1}>"
                for i in range(3)
                for j in range(3)
            )
            out.append(f"<{cov}Covariance>{cells}</{cov}Covariance>")
        out.append(f"</{tag}>")
    return [*out, "</DnaMeasurement>"]


def _xml_line(m: Line) -> list[str]:
    names = "".join(
        f"<{t}>{n}</{t}>" for t, n in zip(("First", "Second", "Third"), m.names, strict=False)
    )
    return [
        f"<DnaMeasurement><Type>{m.type}</Type><Ignore>{'*' if m.ignored else ''}</Ignore>",
        f"{names}<Value>{_xml_value(m.value)}</Value><StdDev>{m.sigma}</StdDev>",
        f"<InstHeight>{m.heights[0]}</InstHeight><TargHeight>{m.heights[1]}</TargHeight>",
        "</DnaMeasurement>",
    ]


def _xml_set(m: Directions) -> list[str]:
    (target, angle), *others = m.rays
    out = [
        f"<DnaMeasurement><Type>D</Type><Ignore/><First>{m.first}</First><Second>{target}</Second>",
        f"<Value>{_xml_value(angle)}</Value><StdDev>{m.sigma}</StdDev><Total>{len(others)}</Total>",
    ]
    for name, value in others:
        out.append(
            f"<Directions><Ignore/><Target>{name}</Target><Value>{_xml_value(value)}</Value>"
            f"<StdDev>{m.sigma}</StdDev></Directions>"
        )
    return [*out, "</DnaMeasurement>"]


def _xml_value(value: tuple[int, int, float] | str | float) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, tuple):
        d, m, s = value
        return f"{d}.{m:02d}{s:07.4f}".replace(".", "#", 1).replace(".", "").replace("#", ".")
    return f"{value:.4f}"
