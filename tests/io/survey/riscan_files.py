"""Write small RiSCAN PRO projects, independently of the reader."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

HEAD = '<?xml version="1.0" standalone="no"?>\n<!DOCTYPE project SYSTEM "./project.dtd">\n'


@dataclass
class Scan:
    """A scan position: targets name -> (vector, accuracies)."""

    name: str
    targets: Mapping[str, tuple[Sequence[float], Sequence[float] | None]]
    sop: np.ndarray | None = None
    registered: bool = True
    gnss: Sequence[float] | None = None
    accuracy: float = 2.0
    enabled: bool = True
    inactive: Sequence[str] = ()
    #: paths of what targets are linked to
    links: Mapping[str, str] = field(default_factory=dict)


@dataclass
class Rsp:
    """A project; glcs and prcs as targets with accuracies or None."""

    scans: list[Scan]
    pop: np.ndarray | None = None
    glcs: dict[str, tuple[Sequence[float], Sequence[float] | None]] = field(default_factory=dict)
    prcs: dict[str, tuple[Sequence[float], Sequence[float] | None]] = field(default_factory=dict)
    glcs_extra: str = ""
    crs: str = ""


def write(project: Rsp, path: Path) -> Path:
    """The project as XML, one element a line."""
    lines = ['<project name="test" kind="ProjectX">', "<name>test</name>"]
    lines += [f"<gsm_project_crs>{project.crs}</gsm_project_crs>"]
    lines += [*_matrix("pop", project.pop), "<scanpositions>"]
    for scan in project.scans:
        lines += [f'<scanposition name="{scan.name}">', f"<name>{scan.name}</name>"]
        if scan.gnss is not None:
            lines += [
                f"<position_accuracy>{scan.accuracy}</position_accuracy>",
                "<position_coordsys>2</position_coordsys>",
                f"<position_enabled>{scan.enabled:d}</position_enabled>",
                f'<position_vector length="3"> {_numbers(scan.gnss)} </position_vector>',
            ]
        lines += ["<ppm_air_temperature>12</ppm_air_temperature>", "<ppm_instrument/>"]
        lines += [f"<registered>{scan.registered:d}</registered>", *_matrix("sop", scan.sop)]
        lines += _points("socs", scan.targets, scan.inactive, links=scan.links)
        lines.append("</scanposition>")
    lines.append("</scanpositions>")
    lines += _points("glcs", project.glcs, (), project.glcs_extra) + _points("prcs", project.prcs)
    path.write_text(HEAD + "\n".join([*lines, "</project>"]))
    return path


def _numbers(values) -> str:
    return " ".join(repr(float(v)) for v in np.ravel(values))


def _matrix(tag: str, matrix: np.ndarray | None) -> list[str]:
    if matrix is None:
        return []
    return [f"<{tag}>", f'<matrix rows="4" cols="4"> {_numbers(matrix)} </matrix>', f"</{tag}>"]


def _points(
    frame: str, points, inactive: Sequence[str] = (), extra: str = "", links: Mapping = {}
) -> list[str]:
    lines = [f"<tpl_{frame}>", "<active>1</active>"]
    for name, (vector, accuracy) in points.items():
        lines.append(f'<tp_{frame} name="{name}">')
        if accuracy is not None:
            lines.append(f'<accuracy length="3"> {_numbers(accuracy)} </accuracy>')
        lines.append(f"<active>{name not in inactive:d}</active>")
        if name in links:
            lines.append(f'<linked_ref noderef="{links[name]}"/>')
        lines.append(f"<name>{name}</name>{extra}")
        lines.append(f'<vector length="3"> {_numbers(vector)} </vector>')
        lines.append(f"</tp_{frame}>")
    return [*lines, f"</tpl_{frame}>"]
