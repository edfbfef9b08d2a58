"""Is it built as designed? A cloud against a model, by element, with verdicts at a stated risk."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import typer

from tribrach._types import Array, Progress
from tribrach.answers import Form, Number, Result
from tribrach.comparison.as_designed import (
    Design,
    DesignPlaces,
    DesignSums,
    DeviationLimits,
    ElementTable,
    element_table,
    point_verdicts,
)
from tribrach.errors import InputError
from tribrach.geometry.mesh import Mesh
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.element_table import elements_csv
from tribrach.io.models.formats import model_unit, read_model
from tribrach.io.tolerance_table import limits_of, read_tolerances
from tribrach.job.cloud_file import CloudFile, refuse_other_systems
from tribrach.job.compare import Registration
from tribrach.report.answer import Answer
from tribrach.report.columns import column
from tribrach.report.findings import Finding
from tribrach.report.names import some_of
from tribrach.report.numbers import counted
from tribrach.report.page import FrontPage
from tribrach.report.tables import ReportTable, build_table
from tribrach.scan.scan import Field
from tribrach.sentences import Sentence
from tribrach.shell.command import WRITTEN
from tribrach.units import MM

#: names in a sentence, and in the header of a cloud
_NAMED, _TOLD = 5, 500
#: a model that is so many times as large as the cloud is in another unit
_OTHER_UNITS = {"millimetres": 1e3, "centimetres": 1e2, "feet": 1 / 0.3048, "inches": 1 / 0.0254}
_LIKE = 1.5
#: a model of so many places along an axis is looked at twice
_HUGE = 2000
#: coordinate step of written points [m]
_STEP = 1e-4


@dataclass(frozen=True)
class Designing:
    """Options of a comparison with a model."""

    tolerance_mm: Annotated[
        float | None,
        typer.Option(min=0.01, help="B is a model: deviation allowed either way, of all elements."),
    ] = None
    tolerances: Annotated[
        Path | None,
        typer.Option(
            help="The same by element, as CSV: element,tolerance_mm or lower_mm,upper_mm."
        ),
    ] = None
    risk: Annotated[
        float, typer.Option(min=1e-4, max=0.4, help="Largest probability of a wrong verdict.")
    ] = 0.05
    by: Annotated[
        Literal["parts", "faces"],
        typer.Option(help="Elements of a model: its named parts, or each flat face of them."),
    ] = "parts"
    place_m: Annotated[
        float, typer.Option(min=0.01, max=100, help="Size of the places that are judged in metres.")
    ] = 0.5
    model_unit: Annotated[
        str | None, typer.Option(help="What a model is counted in: m, mm, ft ...")
    ] = None
    table: Annotated[
        Path | None, typer.Option(help="Write the elements of a model as CSV."), WRITTEN
    ] = None

    def refuse_clouds(self, b: Path) -> None:
        """Refuse options of models where B is a cloud."""
        for field in fields(self):
            if getattr(self, field.name) != field.default:
                raise InputError(
                    f"--{field.name.replace('_', '-')} is of models, and B is a cloud",
                    file=b,
                    cure="give a model as B, or leave the option out",
                )


@dataclass(frozen=True)
class AsDesigned(Result, also=("sentences",)):
    """A cloud against a model; lengths in metres, deviations positive outwards."""

    cloud: str
    design: str
    limit: Number  #: points farther from the model are of something else
    place: Number  #: edge of the places that are judged
    risk: Number  #: largest probability of a wrong verdict on an element
    #: where the sigma of what all points share comes from; null where it is not known
    pose: Literal["poses.json", "stated"] | None
    #: points, those farther than the limit from the model, and those beside its edges
    points: int
    far: int
    beside: int
    verdicts: dict[str, int]  #: elements by verdict
    elements: ElementTable  #: the worst first
    notes: tuple[str, ...]  #: what was left out or assumed of the model

    @property
    def sentences(self) -> list[str]:
        """Verdicts and remarks in words."""
        return [finding.words for finding in _findings(self)]


FORM = Form("as_designed", AsDesigned, 1)


def compare_design(
    cloud: CloudFile,
    b: Path,
    options: Designing,
    *,
    limit: float,
    registration: Registration | None,
    distances: Path | None,
    progress: Progress,
) -> Answer:
    """Compare a cloud, as it was built, with a model.

    ``registration`` is what the user says of the pose of the cloud; ``distances`` a cloud to write,
    with distance, sigma, verdict and element. Points beyond ``limit`` are of something else [m].
    """
    mesh = read_model(b, model_unit(options.model_unit))
    refuse_other_systems(cloud.crs, mesh.crs, b)
    if options.by == "faces":
        mesh = mesh.by_faces()
    low, high = mesh.corners
    extent = _Extent()
    if float((high - low).max()) > _HUGE * options.place_m:
        for xyz in cloud.stream():
            extent.add(xyz)
        if (other := _in_another_unit(mesh, extent, b)) is not None:
            raise other
    design = Design(mesh, cloud.scanner, options.place_m)
    stated = None
    if registration is not None and cloud.placement is None:
        stated = np.diag(np.repeat([registration.shift**2, registration.turn**2], 3))
    sums = DesignSums(design, limit, cloud.placement, stated, (low + high) / 2)
    for xyz in cloud.stream():
        sums.add(xyz)
        extent.add(xyz)
        progress(f"points against {b.name}", sums.points, cloud.records)
    if sums.points == sums.far:
        raise _in_another_unit(mesh, extent, b) or _apart(cloud, mesh, extent, limit, b)
    rest = None
    if options.tolerance_mm is not None:
        rest = DeviationLimits(-options.tolerance_mm * MM, options.tolerance_mm * MM)
    wanted = [] if options.tolerances is None else read_tolerances(options.tolerances)
    limits, unused = limits_of(mesh.names, wanted, rest)
    progress("elements", 0, len(mesh.names))
    elements, places = element_table(sums, limits, options.risk)
    notes = list(mesh.sentences)
    if not design.sides_known:
        notes.append(
            "the model does not tell which side of its faces is seen, nor the cloud where the "
            "scanner stood: signs of deviations follow the order of corners"
        )
    notes += [f"no element is called {pattern}" for pattern in unused]
    result = AsDesigned(
        cloud.path.name,
        b.name,
        limit,
        options.place_m,
        options.risk,
        None if not sums.pose_known else "stated" if cloud.placement is None else "poses.json",
        sums.points,
        sums.far,
        sums.beyond,
        dict(Counter(verdict or "not judged" for verdict in elements.verdict)),
        elements,
        tuple(notes),
    )
    if distances is not None:
        _write(distances, cloud, sums, places, limits, options.risk, progress)
    files = {} if options.table is None else {options.table: elements_csv(elements)}
    return _answer(result, files, [] if distances is None else [distances])


class _Extent:
    """Lowest and highest coordinates of what passes."""

    def __init__(self) -> None:
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)

    def add(self, xyz: Array) -> None:
        """Let points (n, 3) pass."""
        if len(xyz):
            self.low = np.minimum(self.low, np.nanmin(xyz, axis=0))
            self.high = np.maximum(self.high, np.nanmax(xyz, axis=0))


def _in_another_unit(mesh: Mesh, extent: _Extent, b: Path) -> InputError | None:
    """What a model is told that is as much larger than the cloud as another unit makes it."""
    low, high = mesh.corners
    size = float(np.linalg.norm(high - low)) / float(np.linalg.norm(extent.high - extent.low))
    for unit, factor in _OTHER_UNITS.items():
        if 1 / _LIKE < size / factor < _LIKE:
            return InputError(
                Sentence(
                    "the model is {size:0} times as large as the cloud: it may be in {unit}",
                    size=size,
                    unit=unit,
                ),
                file=b,
                cure="say so with --model-unit",
            )
    return None


def _apart(cloud: CloudFile, mesh: Mesh, extent: _Extent, limit: float, b: Path) -> InputError:
    """Reason why no point is near the model."""
    low, high = mesh.corners
    between = float(np.linalg.norm((low + high) / 2 - (extent.low + extent.high) / 2))
    return InputError(
        Sentence(
            "no point of {cloud.path.name} is within {limit:m2} of the model; their middles are "
            "{between:m0} apart",
            cloud=cloud,
            limit=limit,
            between=between,
        ),
        file=b,
        cure="bring both into one frame (tribrach register --reference places scans on a model), "
        "or say the unit of the model with --model-unit",
    )


def _write(
    path: Path,
    cloud: CloudFile,
    sums: DesignSums,
    places: DesignPlaces,
    limits: Mapping[str, DeviationLimits],
    risk: float,
    progress: Progress,
) -> None:
    """The points near the model with distance, sigma, verdict and element."""
    names = sums.design.mesh.names
    written = (
        Field("distance", "float32", description="from the model, positive outwards, m"),
        Field("sigma", "float32", description="of the distance, m; 0 where unknown"),
        Field("verdict", "uint8", description="1 within, 2 not within, 0 cannot be told"),
        Field("element", "uint32", description="number of the element, from 1"),
    )
    more = ["more in the table"] if len(names) > _TOLD else []
    told = [f"{k} {name}" for k, name in enumerate(names[:_TOLD], start=1)]
    facts = {"elements": "; ".join([*told, *more])}
    crs = cloud.crs or sums.design.mesh.crs
    low = np.array([limits[n].lower if n in limits else np.nan for n in names])
    high = np.array([limits[n].upper if n in limits else np.nan for n in names])
    usual = float(np.median(places.scatter)) if len(places) else 0.0
    offset = np.floor(sums.design.mesh.corners[0])
    header = CloudHeader(path.stem, written, step=_STEP, offset=offset, crs=crs, facts=facts)
    done = 0
    with create(path, header) as writer:
        for xyz in cloud.stream():
            done += len(xyz)
            xyz = xyz[np.isfinite(xyz).all(axis=1)]
            used, triangle, d = sums.compared(xyz)
            progress(f"points of {path.name}", done, cloud.records)
            if not used.any():
                continue
            x, t, d = xyz[used], triangle[used], d[used]
            normal = sums.design.normals[t]
            own, rows = sums.own_variance(x, normal), sums.rows(x, normal)
            shared = np.einsum("ni,ij,nj->n", rows, sums.covariance, rows)
            sigma = np.sqrt(np.where(np.isnan(own), usual, own) + np.maximum(shared, 0.0))
            element = sums.design.mesh.element[t]
            verdict = np.zeros(len(x), dtype=np.int64)
            if sums.pose_known:
                verdict = point_verdicts(d, sigma, low[element], high[element], risk)
            writer.write(
                x,
                {
                    "distance": d.astype(np.float32),
                    "sigma": (sigma if sums.pose_known else 0 * sigma).astype(np.float32),
                    "verdict": verdict.astype(np.uint8),
                    "element": (element + 1).astype(np.uint32),
                },
            )


def _findings(found: AsDesigned) -> Iterator[Finding]:
    """Verdicts, what was not seen, what was left out."""
    table = found.elements
    names: dict[str, list[str]] = {}
    for name, verdict in zip(table.element, table.verdict, strict=True):
        names.setdefault(verdict, []).append(name)
    if found.pose is None:
        yield Finding(
            "Nothing is known of how well the cloud lies in the frame of the model, so there is no "
            "verdict: keep poses.json and poses_covariance.npy beside it, or state "
            "--registration-mm.",
            True,
            "pose_unknown",
        )
    for verdict, key in (
        ("not within", "not_within"), ("cannot tell", "cannot_tell"), ("within", "within"),
    ):  # fmt: skip
        some = names.get(verdict, [])
        if some:
            words = {
                "not within": "{count} {noun} not within the tolerance: {names}.",
                "cannot tell": "Of {count} it cannot be told at a risk of {risk:%}: {names}. A "
                "smaller sigma would tell.",
                "within": "{count} {noun} within the tolerance where it was seen.",
            }[verdict]
            yield Finding.of(
                key,
                words,
                warns=verdict == "not within",
                count=counted(len(some), "element"),
                noun="is" if len(some) == 1 else "are",
                names=some_of(some, _NAMED),
                risk=found.risk,
            )
    unseen = names.get("not seen", [])
    if unseen:
        yield Finding.of(
            "not_seen",
            "Not seen: {names}. Nothing is said of them.",
            warns=True,
            names=some_of(unseen, _NAMED),
        )
    yield Finding.of(
        "compared",
        "{share:%} of the points are of the model; {far:%} are farther than {f.limit:mm0} from it "
        "and count as of something else.",
        share=1 - (found.far + found.beside) / max(found.points, 1),
        far=found.far / max(found.points, 1),
        f=found,
    )
    yield from (Finding(f"{note[0].upper()}{note[1:]}.", True, "note") for note in found.notes)


def _front(found: AsDesigned) -> FrontPage:
    """The verdict on the whole."""
    count = found.verdicts
    judged = sum(count.get(v, 0) for v in ("within", "not within", "cannot tell"))
    signed = "The deviations and verdicts stated here, of what was seen and of nothing else."
    first = next(_findings(found)).words
    if not judged:
        return FrontPage("none", "Measured, not judged", first, signed=signed)
    if count.get("not within"):
        verdict = f"{count['not within']} of {counted(judged, 'element')} not within tolerance"
        return FrontPage("bad", verdict, first, signed=signed)
    if count.get("cannot tell"):
        verdict = f"{count['cannot tell']} of {counted(judged, 'element')} cannot be told"
        return FrontPage("none", verdict, first, signed=signed)
    return FrontPage("good", "Within tolerance where it was seen", first, signed=signed)


def _answer(found: AsDesigned, files: Mapping[Path, str], written: list[Path]) -> Answer:
    """The comparison as people read it, worst first."""
    said = list(_findings(found))
    table = _table(found)
    return Answer(
        "As designed",
        f"{found.cloud} against {found.design}",
        _front(found),
        found,
        FORM,
        findings=said,
        first=[table],
        terminal=[table, *said],
        files=files,
        written=written or None,
        footer="Deviations are along normals, positive outwards. A verdict is on all places of "
        "the element that were seen, at the stated risk; it is none on what was not.",
    )


def _table(found: AsDesigned) -> ReportTable:
    """Elements, the worst first."""
    marks = {"within": "good", "not within": "bad"}
    columns = [
        column("Element", "element"),
        column("Verdict", "verdict", mark=lambda r: marks.get(r.verdict, "")),
        column("allowed", "upper", "mm1"),
        column("mean", "mean", "mm1"),
        column("σ", "sigma", "mm1"),
        column("lowest", "lowest", "mm1"),
        column("σ", "lowest_sigma", "mm1", wide=True),
        column("highest", "highest", "mm1"),
        column("σ", "highest_sigma", "mm1", wide=True),
        column("tilt", lambda r: r.tilt / MM, "1", unit="mm/m"),
        column("σ", lambda r: r.tilt_sigma / MM, "1", unit="mm/m", wide=True),
        column("turn", lambda r: r.turn / MM, "1", unit="mm/m", wide=True),
        column("plumb", lambda r: r.plumb / MM, "1", unit="mm/m"),
        column("flatness", "flatness", "mm1", wide=True),
        column("seen", "seen", "%0"),
        column("places", "places", "0", wide=True),
        column("left out", "left_out", "0", wide=True),
    ]
    note = (
        "Lowest and highest are of places, positive outwards; tilt and turn of flat elements "
        "against the model, plumb of those that stand, positive where they overhang. Left out are "
        "points that are of something else by the others of their place."
    )
    return build_table(
        "elements", "Elements, the worst first", note, found.elements.each(), columns
    )
