"""Reads XML files, without letting them make the parser read anything else.

No entities, no network, no external DTD, no huge trees, and a size limit: a survey file needs none
of them.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from lxml import etree

from tribrach.errors import InputError
from tribrach.io.opened_files import contents

#: files above this are refused (200 MB)
MAX_BYTES = 200_000_000


def read_bytes(path: Path, most: int | None = None) -> bytes:
    """Bytes of a file that is not empty and not above ``most`` bytes, 200 MB if not given."""
    try:
        size = path.stat().st_size
        largest = MAX_BYTES if most is None else most
        if size > largest:
            raise InputError(
                f"the file has {size / 1e6:.3g} MB, more than {largest / 1e6:.3g} MB",
                file=path,
            )
        # what has no size, such as a pipe, is not read beyond it either
        data = contents(path, largest + 1)
        if len(data) > largest:
            raise InputError(f"it has more than {largest / 1e6:.3g} MB", file=path)
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})",
            file=path,
            cure="check the path",
        ) from error
    if not data.strip():
        raise InputError("the file is empty", file=path)
    return data


def load(path: Path, root: str, *others: str) -> etree._Element:
    """Root element of an XML file; ``sourceline`` of its elements gives the lines."""
    data = read_bytes(path)
    if re.search(rb"<!ENTITY", data):
        line = data[: data.index(b"<!ENTITY")].count(b"\n") + 1
        raise _entities(path, line)
    rest = data.lstrip()
    if rest.startswith(b"<?xml") and b"?>" in rest:
        # blank lines before the declaration go behind it, which keeps the numbers of lines
        declaration, _, body = rest.partition(b"?>")
        data = declaration + b"?>" + data[: len(data) - len(rest)] + body
    parser = etree.XMLParser(
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
        recover=False,
    )
    try:
        element = etree.fromstring(data, parser)
    except (etree.XMLSyntaxError, LookupError, ValueError) as error:
        position: int | None = getattr(error, "lineno", None)
        what = str(getattr(error, "msg", error)).splitlines()[0].rstrip(".")
        raise InputError(f"the XML cannot be read: {what}", file=path, line=position) from error
    dtd: Any = element.getroottree().docinfo.internalDTD
    # encodings such as UTF-16 hide the declaration from the search in the bytes
    if dtd is not None and any(True for _ in dtd.iterentities()):
        raise _entities(path, None)
    if element.tag not in (root, *others):
        raise InputError(
            f"the root element is <{element.tag}>, not <{root}>",
            file=path,
            line=line_of(element),
            cure="give a file of this format",
        )
    return element


def line_of(element: etree._Element) -> int | None:
    """1-based line of an element, None if unknown."""
    line: Any = element.sourceline
    return None if line is None else int(line)


def _entities(path: Path, line: int | None) -> InputError:
    return InputError(
        "the XML declares entities, which are refused",
        file=path,
        line=line,
        cure="remove the <!ENTITY> declarations",
    )
