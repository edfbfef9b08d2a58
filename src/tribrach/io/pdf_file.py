"""PDF/A-3 documents: text and drawings by Typst, the field for a signature by pyhanko."""

from __future__ import annotations

import datetime
import io
from collections.abc import Mapping

from tribrach.errors import InputError
from tribrach.scratch import scratch_folder

_INSTALL = 'install it: pip install "tribrach[pdf]"'
#: place of the field for a signature on the first page [pt]: at the foot, to the right
_FIELD = (590, 8, 808, 36)


def pdf_document(source: str, files: Mapping[str, bytes], date: datetime.date) -> bytes:
    """A document of PDF/A-3b with its attachments and an empty field for a signature."""
    try:
        import typst
        from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
        from pyhanko.sign.fields import SigFieldSpec, append_signature_field
    except ImportError as error:
        raise InputError(f"PDF needs the package {error.name}", cure=_INSTALL) from error

    moment = datetime.datetime.combine(date, datetime.time(), datetime.UTC)
    dated = (
        f"#set document(date: datetime(year: {date.year}, month: {date.month}, day: {date.day}, "
        "hour: 0, minute: 0, second: 0))\n"
    )
    with scratch_folder() as place:
        for name, data in files.items():
            (place / name).write_bytes(data)
        (place / "main.typ").write_text(dated + source, encoding="utf-8")
        try:
            made = typst.compile(
                str(place / "main.typ"),
                root=str(place),
                format="pdf",
                pdf_standards=["a-3b"],
                timestamp=int(moment.timestamp()),
            )
        except typst.TypstError as error:
            raise InputError(f"the page cannot be set ({error})") from error
    writer = IncrementalPdfFileWriter(io.BytesIO(made))
    field = SigFieldSpec("Signature", on_page=0, box=_FIELD, empty_field_appearance=True)
    append_signature_field(writer, field)
    out = io.BytesIO()
    writer.write(out)  # type: ignore[no-untyped-call]
    return out.getvalue()
