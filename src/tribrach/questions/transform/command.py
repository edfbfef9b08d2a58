"""The commands transform fit and transform apply: from one system to another by common points."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer
from numpy.typing import NDArray

from tribrach._types import Array, Progress
from tribrach.errors import InputError
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.point_list import point_list_text, read_point_list
from tribrach.io.scans.formats import read_scans
from tribrach.io.transformation_file import read_transformation
from tribrach.questions.transform.chapters import answer_of
from tribrach.questions.transform.fit import fit_files
from tribrach.report.answer import Answer
from tribrach.scan.scan import Field, Scan
from tribrach.sentences import Sentence
from tribrach.shell.command import WRITTEN, command
from tribrach.shell.help_words import SpokenCommand, SpokenGroup
from tribrach.statistics import t
from tribrach.transformation.carrying import Carrier

_SIGMAS = ("sigma_x", "sigma_y", "sigma_z")
_CORRELATIONS = {"correlation_xy": (0, 1), "correlation_xz": (0, 2), "correlation_yz": (1, 2)}
_NORMALS = ("normal_x", "normal_y", "normal_z")


def move_points(source: Path, carrier: Carrier) -> tuple[str, list[str]]:
    """The table of a file of points in the other system, and what to say about it."""
    given = read_point_list(source)
    if given.dimension < carrier.transformation.model.dimension:
        raise InputError(
            "the points have no heights, and the transformation is one in space",
            file=source,
            cure="give heights, or fit the transformation in the plane",
        )
    covariance = None
    sentences = []
    if given.covariance is not None or carrier.covariance is not None:
        covariance = carrier.covariances(given.xyz, given.covariance)
    if given.covariance is None:
        sentences.append(
            "the points have no sigmas: the covariances are those of the transformation alone"
            if covariance is not None
            else "neither points nor transformation have sigmas: none are written"
        )
    elif carrier.covariance is None:
        sentences.append("the transformation has no covariance: that of the points alone is turned")
    else:
        sentences.append("what the transformation contributes is common to all points")
    sentences += _freedom(carrier)
    return point_list_text(given.names, carrier.points(given.xyz), covariance), sentences


def _freedom(carrier: Carrier) -> list[str]:
    """How much wider intervals are where the variance comes from few residuals."""
    if carrier.freedom is None:
        return []
    return [
        Sentence(
            "the sigmas of the transformation rest on {own.freedom} redundant values: 95 % "
            "intervals take {factor:2} of them, not 1.96",
            own=carrier,
            factor=float(t.ppf(0.975, carrier.freedom)),
        )
    ]


def move_cloud(
    scans: Sequence[Scan],
    destination: Path,
    carrier: Carrier,
    step: float,
    progress: Callable[[str, int, int | None], None],
) -> list[str]:
    """Write a cloud through a transformation, its sigmas propagated; step [m] of integers.

    What is to be said about it is returned. Scans are placed by the poses they have and end in
    one file.
    """
    if destination.resolve() in {scan.path.resolve() for scan in scans}:
        raise InputError(
            "the file would overwrite its source", file=destination, cure="name another file"
        )
    if any(scan.names != scans[0].names for scan in scans):
        raise InputError(
            "the scans of the file have different fields",
            file=scans[0].path,
            cure="convert them one by one first",
        )
    fields = scans[0].fields
    own = all(name in scans[0].names for name in _SIGMAS)
    with_sigma = own or carrier.covariance is not None
    what = "of the points and the transformation" if own else "of the transformation alone"
    # correlations are no longer those of these axes, so they are written anew or not at all
    kept = tuple(f for f in fields if f.name not in (*_SIGMAS, *_CORRELATIONS))
    added = tuple(Field(n, "float32", description=f"[m] {what}") for n in _SIGMAS)
    header = CloudHeader(
        name=scans[0].name,
        fields=(*kept, *added) if with_sigma else kept,
        step=step,
        offset=_offset(scans[0], carrier),
    )
    done = 0
    with ExitStack() as stack:
        writer = stack.enter_context(create(destination, header))
        for scan in scans:
            for chunk in scan.chunks():
                xyz = chunk.xyz if scan.pose is None else scan.pose @ chunk.xyz
                values = _carried(chunk.values, xyz, carrier, own, with_sigma)
                writer.write(carrier.points(xyz), values)
                done += len(chunk)
                progress(scans[0].name, done, scan.records)
    return [f"{done} points", *_cloud_sentences(own, carrier, scans[0])]


def _offset(scan: Scan, carrier: Carrier) -> Array:
    """A round place among the points in the other system."""
    box = scan.bounds
    if box is None or not np.isfinite(box).all():
        first = next((c.xyz for c in scan.chunks() if len(c)), np.zeros((1, 3)))
        box = np.stack([first.min(axis=0), first.max(axis=0)])
    middle = (box if scan.pose is None else scan.pose @ box).mean(axis=0)
    out: Array = np.round(carrier.points(middle[None])[0], -1)
    return out


def _carried(
    values: Mapping[str, NDArray[Any]], xyz: Array, carrier: Carrier, own: bool, with_sigma: bool
) -> dict[str, NDArray[Any]]:
    """Values of a chunk: sigmas propagated, normals turned."""
    out = {n: v for n, v in values.items() if n not in (*_SIGMAS, *_CORRELATIONS)}
    if all(name in out for name in _NORMALS):
        normals = np.stack([out[n] for n in _NORMALS], axis=1) @ carrier.rotation().T
        out |= dict(zip(_NORMALS, normals.astype(np.float32).T, strict=True))
    if with_sigma:
        variance = _variances(values, xyz, carrier, own)
        out |= {n: np.sqrt(variance[:, k]).astype(np.float32) for k, n in enumerate(_SIGMAS)}
    return out


def _variances(
    values: Mapping[str, NDArray[Any]], xyz: Array, carrier: Carrier, own: bool
) -> Array:
    """Variances (n, 3) of carried points."""
    variance = np.zeros((len(xyz), 3))
    if carrier.covariance is not None:
        lever, d = carrier.levers(xyz), carrier.transformation.model.dimension
        values_q, vectors = np.linalg.eigh(carrier.covariance)
        root = vectors * np.sqrt(np.maximum(values_q, 0.0))
        variance[:, :d] += ((lever @ root) ** 2).sum(axis=2)
    if own:
        matrix = carrier.matrix(3)
        sigma = np.stack([np.asarray(values[n], dtype=float) for n in _SIGMAS], axis=1)
        variance += sigma**2 @ (matrix**2).T
        for name, (i, j) in _CORRELATIONS.items():
            if name in values:
                shared = np.asarray(values[name], dtype=float) * sigma[:, i] * sigma[:, j]
                variance += 2 * shared[:, None] * (matrix[:, i] * matrix[:, j])
    return variance


def _cloud_sentences(own: bool, carrier: Carrier, scan: Scan) -> list[str]:
    """What the sigmas of the cloud hold and what they do not."""
    if not own and carrier.covariance is None:
        return ["neither cloud nor transformation have sigmas: none are written"]
    out = []
    if not own:
        out.append("the cloud has no sigmas: those written are of the transformation alone")
    elif carrier.covariance is None:
        out.append("the transformation has no covariance: the sigmas of the points are turned")
    if own and not any(name in scan.names for name in _CORRELATIONS):
        out.append("correlations of the points are not in the source and are taken as zero")
    if own and carrier.covariance is not None:
        out.append("what the transformation contributes is common to all points")
    return out + _freedom(carrier)


transform = typer.Typer(
    cls=SpokenGroup,
    add_completion=False,
    no_args_is_help=True,
    help="Fit a transformation to common points, and apply it.",
)


@transform.command(cls=SpokenCommand)
@command(json="Write it as JSON, for transform apply.", html=None)
def fit(
    a: Annotated[Path, typer.Argument(metavar="A", help="Points as CSV: point,x_m,y_m,z_m.")],
    b: Annotated[Path, typer.Argument(metavar="B", help="The same points in the other system.")],
    model: Annotated[
        int | None,
        typer.Option(
            help="Number of parameters: 3, 4, 6, 7, 9, 12, without heights 3, 4, 6; 7 or 4 if not "
            "given."
        ),
    ] = None,
    check: Annotated[
        list[str] | None, typer.Option(help="A point held out as check point; repeat it.")
    ] = None,
    snoop: Annotated[bool, typer.Option(help="Switch off points that do not fit.")] = False,
    angle: Annotated[Literal["gon", "deg"], typer.Option(help="Unit of angles.")] = "gon",
) -> Answer:
    """Fit the transformation from A to B with the weights of both, and test it."""
    return answer_of(fit_files(a, b, model, check or [], snoop=snoop), angle)


@transform.command(cls=SpokenCommand)
@command(json=None, html=None, scans=True)
def apply(
    transformation: Annotated[Path, typer.Argument(help="The JSON file of transform fit.")],
    source: Annotated[Path, typer.Argument(help="Points as CSV, or a cloud.")],
    destination: Annotated[
        Path, typer.Argument(help="File to write: .csv, or that of a cloud."), WRITTEN
    ],
    inverse: Annotated[bool, typer.Option(help="From B to A.")] = False,
    step_mm: Annotated[
        float, typer.Option(min=1e-3, max=10, help="Coordinate step of LAS and LAZ.")
    ] = 0.1,
    *,
    progress: Progress,
) -> Answer:
    """Carry points or a cloud through a transformation, with their covariances."""
    stored = read_transformation(transformation)
    carrier = Carrier(stored.transformation, stored.covariance, inverse, stored.freedom)
    files = {}
    if source.suffix.lower() == ".csv":
        if destination.suffix.lower() != ".csv":
            raise InputError(
                "a table of points becomes a table", file=destination, cure="name it .csv"
            )
        files[destination], said = move_points(source, carrier)
    else:
        said = move_cloud(read_scans(source), destination, carrier, step_mm / 1e3, progress)
    words = f"{destination}: {'; '.join(said) or 'written'}"
    return Answer("Transformation", source.name, None, None, terminal=[words], files=files)
