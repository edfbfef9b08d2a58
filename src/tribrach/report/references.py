"""Tables of references: where they lie, and how much of each scan lies on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from tribrach.report.columns import column, millimetres
from tribrach.report.tables import ReportTable, build_table

if TYPE_CHECKING:
    from tribrach.registration.clouds.reference import PlacedOn, ReferenceOffset, UsedReference


def reference_tables(
    used: Sequence[UsedReference],
    offsets: Sequence[ReferenceOffset],
    placed_on: Sequence[PlacedOn],
) -> tuple[ReportTable, ...]:
    """References with their offsets, and scans on them; none without references."""
    if not used:
        return ()
    told = {offset.name: offset for offset in offsets}

    def offset(get: Any) -> Any:
        return lambda r: None if r.name not in told else get(told[r.name])

    def component(which: str, k: int) -> Any:
        return offset(lambda o: getattr(o, which)[k])

    columns = [
        column("Reference", "name"),
        column("Points", lambda r: r.count, "0"),
        millimetres("Sigma", "sigma"),
        millimetres("Shared", "shared"),
        *(
            millimetres(head + axis, component(which, k), wide=which == "sigma")
            for which, head in (("offset", "Offset "), ("sigma", "σ "))
            for k, axis in enumerate("xyz")
        ),
        column("Test", offset(lambda o: o.statistic), "1"),
        column("Limit", offset(lambda o: o.limit), "1", wide=True),
    ]
    note = (
        "An offset is that of the whole reference, from its file to the result. It is tested where "
        "something else than its prior tells it: control, or a second reference."
    )
    on = [
        column("Scan", "scan"),
        column("Reference", "reference"),
        column("Area", "area", "0", unit="m²"),
        column("Agrees", "agrees", "%0"),
        column("Left out", "left_out", "%0"),
    ]
    share = (
        "Surfaces of the scan within 0.5 m of the reference: what agrees, and what the test left "
        "out, such as vegetation and what changed."
    )
    return (
        build_table("references", "References", note, used, columns),
        build_table("placed_on", "Scans on references", share, placed_on, on),
    )
