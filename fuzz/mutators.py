"""Mutations that know what files are made of: lines, fields, numbers, headers, tags, checksums.

A mutation takes the bytes of a seed, a generator of random numbers and the other seeds of the same
reader, and returns other bytes. Everything random comes from the generator, so that an input is
found again by the reader's name and its number.
"""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import re
import struct
import zipfile
from collections.abc import Callable, Sequence
from random import Random

from tribrach.io.e57_pages import PAGE, PAYLOAD, paged

__all__ = ["STYLES", "Mutation"]

Mutation = Callable[[bytes, Random, Sequence[bytes]], bytes]

#: what stands in place of a number
_NUMBERS = (
    b"0", b"-0", b"1", b"-1", b"2", b"7", b"255", b"256", b"65535", b"65536", b"2147483647",
    b"2147483648", b"-2147483649", b"4294967295", b"4294967296", b"9223372036854775807",
    b"18446744073709551616", b"1e5", b"1e9", b"1e13", b"1e100", b"1e308", b"1e309", b"-1e308",
    b"1e-308", b"5e-324", b"nan", b"inf", b"-inf", b"NaN", b"Infinity", b"1" * 30, b"9" * 400,
    b"0." + b"3" * 200, b"0x10", b"1_000", b"1,5", b"1.5.2", b"+-1", b"1e", b"--", b"", b"1/0",
    "\u0661\u0662".encode(), "\u00b2".encode(), b"200000000000", b"360", b"400", b"-90", b"90.0001",
)  # fmt: skip
#: what stands in place of a word, or between words
_WORDS = (
    b"", b" ", b"\t", b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", "\u00e9\u00df".encode(),
    b"[red]x[/red]", b"[/]", b"<b>&amp;</b>", b"&lt;", b"<![CDATA[x]]>", b"<!--", b"'", b'"',
    b"'''", b'"""', b"=1+1", b"../../../etc/passwd", b"/dev/zero", b"\\", b"\r", b"\n", b"\r\n",
    b"\x0c", b"\x1b[31m", b"%s%n", b"{0}", b"A" * 5000, b"#", b";", b",", b"$", b"*", b"None",
    b"null", b"true", b"[]", b"{}", "\u202e".encode(), "\U0001f600".encode(), b"\xed\xa0\x80",
    b"-", b".", b":", b"|",
)  # fmt: skip
_NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eEdD][-+]?\d+)?")
_INTEGER = re.compile(rb"(?<![\d.])\d+(?![\d.])")
_WORD = re.compile(rb"[^\s,;|:<>=\"]+")
_TAG = re.compile(rb"<(/?)([A-Za-z_:][\w:.-]*)([^<>]*)>")
_ATTRIBUTE = re.compile(rb"\s([A-Za-z_:][\w:.-]*)\s*=\s*(\"[^\"]*\"|'[^']*')")
_KEY = re.compile(rb"^\s*\"?([A-Za-z_][\w-]*)\"?\s*[=:]", re.M)
#: integers that headers are believed to be
_SIZES = (0, 1, 2, 3, 0x7F, 0x80, 0xFF, 0x100, 0x7FFF, 0x8000, 0xFFFF, 0x10000, 0xFFFFFF, 10**6,
          10**8, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF)  # fmt: skip
_LONG_SIZES = (*_SIZES, 10**10, 2**40, 2**62, 2**63 - 1, 2**63, 2**64 - 8, 2**64 - 1)
_FLOATS = (0.0, -0.0, 1.0, -1.0, 1e-300, 1e300, 1e38, float("inf"), float("-inf"), float("nan"))
#: a file never grows beyond this: the limits are about what a few bytes do
_LARGEST = 60_000


def _several(data: bytes, rng: Random, one: Callable[[bytes], bytes]) -> bytes:
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 6))):
        data = one(data)[:_LARGEST]
    return data


def _spot(rng: Random, length: int) -> int:
    """A place in so many bytes; half of all lie in the first of them, where headers are."""
    if length <= 1:
        return 0
    return rng.randrange(min(length, 512)) if rng.random() < 0.5 else rng.randrange(length)


def _of(rng: Random, found: Sequence[re.Match[bytes]]) -> re.Match[bytes] | None:
    """One of the places; a third of all are among the first, where headers and counts are."""
    if not found:
        return None
    return rng.choice(found[:12]) if rng.random() < 0.33 else rng.choice(found)


def _put(data: bytes, match: re.Match[bytes] | None, text: bytes) -> bytes:
    return data if match is None else data[: match.start()] + text + data[match.end() :]


def _raw(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """Bits, bytes, cuts and repeated pieces, whatever the format."""
    at = _spot(rng, len(data))
    length = rng.choice((1, 1, 2, 4, 8, 30, 200))
    match rng.randrange(9):
        case 0:
            return data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]
        case 1:
            return data[:at] + rng.randbytes(length) + data[at + length :]
        case 2:
            return data[: rng.randrange(len(data) + 1)]
        case 3:
            return data[: max(len(data) - length, 0)]
        case 4:
            return data[:at] + data[at + length :]
        case 5:
            return data[:at] + data[at : at + length] * rng.choice((2, 2, 5, 40)) + data[at:]
        case 6:
            return data[:at] + b"\x00" * length + data[at + length :]
        case 7:
            other = rng.choice(others) if others else data
            return data[:at] + other[_spot(rng, len(other)) :]
        case _:
            to = _spot(rng, len(data))
            piece = data[at : at + length]
            return data[:to] + piece + data[to + len(piece) :]


def _number(data: bytes, rng: Random) -> bytes:
    """Another number in the place of one, in the same columns or not."""
    match = _of(rng, list(_NUMBER.finditer(data)))
    if match is None:
        return data
    text = match.group()
    match_kind = rng.randrange(8)
    if match_kind == 0 and text.isdigit() and len(text) < 19:
        new = str(max(int(text) + rng.choice((-2, -1, 1, 2, 10, -int(text))), 0)).encode()
    elif match_kind == 1:
        new = text[:-1] + rng.choice((b"0", b"9", b"D", b"e", b"-"))
    elif match_kind == 2:
        new = text.replace(b".", b"", 1) if b"." in text else text[:1] + b"." + text[1:]
    elif match_kind == 3:
        new = b"-" + text.lstrip(b"+-") if not text.startswith(b"-") else text[1:]
    elif match_kind == 4:
        new = text * 2
    else:
        new = rng.choice(_NUMBERS)
    if rng.random() < 0.4 and len(new) <= len(text):
        new = new.rjust(len(text))  # columns stay where they are
    return _put(data, match, new)


def _word(data: bytes, rng: Random) -> bytes:
    """Another word in the place of one: an odd one, or one from elsewhere in the file."""
    found = list(_WORD.finditer(data))
    match = _of(rng, found)
    if match is None:
        return data
    if rng.random() < 0.5:
        return _put(data, match, rng.choice(_WORDS))
    other = rng.choice(found)
    if rng.random() < 0.5 and other.start() > match.end():
        # two fields that change places
        return (
            data[: match.start()]
            + other.group()
            + data[match.end() : other.start()]
            + match.group()
            + data[other.end() :]
        )
    return _put(data, match, other.group())


def _line(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """Lines that are left out, doubled, moved, cut, joined, or another file's."""
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    k = rng.randrange(min(len(lines), 12)) if rng.random() < 0.3 else rng.randrange(len(lines))
    some = rng.choice((1, 1, 1, 2, 5))
    match rng.randrange(9):
        case 0:
            del lines[k : k + some]
        case 1:
            lines[k:k] = lines[k : k + some] * rng.choice((1, 1, 2, 20))
        case 2:
            to = rng.randrange(len(lines))
            lines[k], lines[to] = lines[to], lines[k]
        case 3:
            lines[k] = lines[k][: rng.randrange(len(lines[k]) + 1)]
        case 4:
            lines[k] = lines[k].rstrip(b"\r\n")
        case 5:
            lines = lines[:k]
        case 6:
            theirs = (rng.choice(others) if others else data).splitlines(keepends=True)
            lines.insert(k, rng.choice(theirs) if theirs else b"\n")
        case 7:
            lines[k] = b" " * rng.choice((1, 2, 80)) + lines[k]
        case _:
            words = lines[k].split()
            if words:
                words.pop(rng.randrange(len(words)))
            lines[k] = b" ".join(words) + b"\n"
    return b"".join(lines)


def _integer(data: bytes, rng: Random) -> bytes:
    """A count of the header that is another."""
    found = list(_INTEGER.finditer(data[:3000]))
    match = _of(rng, found)
    new = rng.choice((b"0", b"1", b"-1", b"2", b"1000000", b"4294967295", b"99999999999999999999"))
    return _put(data, match, new)


def _as_text(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    match rng.randrange(10):
        case 0 | 1 | 2:
            return _number(data, rng)
        case 3 | 4:
            return _word(data, rng)
        case 5 | 6 | 7:
            return _line(data, rng, others)
        case 8:
            return _integer(data, rng)
        case _:
            return _raw(data, rng, others)


def text(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """Lines of words and numbers."""
    if rng.random() < 0.02:
        codes = ("utf-16", "utf-16-le", "latin-1", "utf-32", "utf-8-sig")
        return data.decode("utf-8", "replace").encode(rng.choice(codes), "replace")
    return _several(data, rng, lambda d: _as_text(d, rng, others) if d else d)


def _as_xml(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    tags = list(_TAG.finditer(data))
    kind = rng.randrange(12)
    if not tags or kind > 7:
        return _as_text(data, rng, others)
    tag = rng.choice(tags)
    if kind == 0:
        return _put(data, tag, b"")
    if kind == 1:
        return _put(data, tag, rng.choice(tags).group())
    if kind in (2, 3, 4) and not tag.group(1):
        # a whole element without elements of its own name
        end = data.find(b"</" + tag.group(2) + b">", tag.end())
        stop = tag.end() if end < 0 else end + len(tag.group(2)) + 3
        whole = data[tag.start() : stop]
        if kind == 2:
            return data[: tag.start()] + data[stop:]
        if kind == 3:
            return data[:stop] + whole * rng.choice((1, 1, 3, 50)) + data[stop:]
        to = rng.choice(tags).start()
        return data[:to] + whole + data[to:]
    attributes = list(_ATTRIBUTE.finditer(data))
    if kind in (5, 6) and attributes:
        attribute = rng.choice(attributes)
        if kind == 5:
            return _put(data, attribute, b"")
        value = rng.choice((*_NUMBERS, *_WORDS)).replace(b'"', b"").replace(b"<", b"&lt;")
        return _put(data, attribute, b" " + attribute.group(1) + b'="' + value + b'"')
    # the text between two tags
    end = data.find(b"<", tag.end())
    value = rng.choice((*_NUMBERS, *_WORDS))
    return data[: tag.end()] + value + data[end:] if end > 0 else data


def xml(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """Elements, attributes and the texts between them."""
    if rng.random() < 0.01:
        entity = b'<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;">]>'
        head = data.find(b"?>") + 2
        return data[:head] + entity + data[head:]
    return _several(data, rng, lambda d: _as_xml(d, rng, others) if d else d)


def keyed(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """TOML and JSON: keys that are left out, doubled, others' or of another type."""

    def one(d: bytes) -> bytes:
        keys = list(_KEY.finditer(d))
        if not keys or rng.random() < 0.6:
            return _as_text(d, rng, others) if d else d
        key = rng.choice(keys)
        end = d.find(b"\n", key.end())
        end = len(d) if end < 0 else end
        match rng.randrange(4):
            case 0:
                return d[: key.start()] + d[end:]
            case 1:
                return d[:end] + d[key.start() : end] + d[end:]
            case 2:
                values = (b'"x"', b"[]", b"{}", b"[[1]]", b"true", b"null", b"1979-05-27", b"-1")
                return d[: key.end()] + b" " + rng.choice((*values, *_NUMBERS)) + d[end:]
            case _:
                at, to = key.span(1)
                return d[:at] + rng.choice(keys).group(1) + d[to:]

    return _several(data, rng, one)


def binary(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """Numbers of any width and byte order at any place, and raw damage."""

    def one(d: bytes) -> bytes:
        if len(d) < 16 or rng.random() < 0.4:
            return _raw(d, rng, others) if d else d
        order, form = rng.choice("<<<>"), rng.choice("BHHIIIQQfd")
        width = struct.calcsize(form)
        at = min(_spot(rng, len(d)), len(d) - width)
        if rng.random() < 0.7:
            at -= at % min(width, 4)
        if form in "fd":
            value: float = rng.choice(_FLOATS)
            value = float("inf") if form == "f" and abs(value) > 3e38 else value
        else:
            (old,) = struct.unpack_from(order + form, d, at)
            near = (old + 1, old - 1, 2 * old, len(d), len(d) - at)
            value = rng.choice((*_LONG_SIZES, *near)) % (1 << (8 * width))
        return d[:at] + struct.pack(order + form, value) + d[at + width :]

    return _several(data, rng, one)


def headed(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """A header of text and a body of bytes, as PLY and PCD have them."""
    ends = (b"end_header\n", b"DATA binary\n", b"DATA binary_compressed\n", b"DATA ascii\n")
    end = max(data.find(e) + len(e) if e in data else 0 for e in ends)
    head, body = data[:end], data[end:]
    heads = [o[: max(o.find(e) + len(e) if e in o else 0 for e in ends)] for o in others]
    match rng.randrange(4):
        case 0 | 1:
            return text(head, rng, heads) + body
        case 2:
            return head + (binary(body, rng, ()) if body else body)
        case _:
            return binary(data, rng, others)


def las(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """The numbers of the header of LAS, of its records, and of the chunks behind them."""
    if len(data) < 227 or rng.random() < 0.3:
        return binary(data, rng, others)

    def one(d: bytes) -> bytes:
        if len(d) < 227:
            return d
        begin = struct.unpack_from("<I", d, 96)[0]
        fields = [(24, "B"), (25, "B"), (94, "H"), (96, "I"), (100, "I"), (104, "B"), (105, "H"),
                  (107, "I"), *((111 + 4 * k, "I") for k in range(5)),
                  *((131 + 8 * k, "d") for k in range(12))]  # fmt: skip
        if d[25] >= 4 and len(d) >= 375:
            fields += [(227, "Q"), (235, "Q"), (243, "I"), (247, "Q"), (255, "Q")]
        # the headers and contents of records before the points, and the first of the points
        for key in (b"laszip encoded", b"copc", b"LASF_Spec", b"LASF_Projection", b"tribrach"):
            at = d.find(key)
            if at > 0:
                fields += [(at + 16, "H"), (at + 18, "H")]
                fields += [(at + 52 + 2 * k, rng.choice("HIQ")) for k in range(40)]
        fields += [(begin + 4 * k, rng.choice("IQ")) for k in range(24)]
        fields += [(len(d) - 4 * k, rng.choice("IQ")) for k in range(2, 24)]
        at, form = rng.choice(fields)
        width = struct.calcsize(form)
        if not 0 <= at <= len(d) - width:
            return d
        if form == "d":
            value: float = rng.choice(_FLOATS)
        else:
            (old,) = struct.unpack_from("<" + form, d, at)
            near = (old + 1, old - 1, 2 * old, len(d), len(d) - at, begin)
            value = rng.choice((*_LONG_SIZES, *near)) % (1 << (8 * width))
        return d[:at] + struct.pack("<" + form, value) + d[at + width :]

    return _several(data, rng, one)


def e57(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """The XML section and the binary sections of E57, with checksums that are right again."""
    if len(data) % PAGE or rng.random() < 0.1:
        return binary(data, rng, others)
    content = b"".join(data[k : k + PAYLOAD] for k in range(0, len(data), PAGE))
    offset, length = struct.unpack_from("<QQ", content, 24)
    start = offset // PAGE * PAYLOAD + offset % PAGE
    body, section = bytearray(content[:start]), content[start : start + length]
    if rng.random() < 0.55:
        section = xml(section, rng, [])
    else:
        body[48:] = binary(bytes(body[48:]), rng, ())
        if rng.random() < 0.5:
            # heads of compressed vectors and of packets of data
            at = 48 + rng.randrange(min(200, max(len(body) - 56, 1)))
            at -= at % 4
            if at + 8 <= len(body):
                struct.pack_into("<Q", body, at, rng.choice(_LONG_SIZES) % (1 << 64))
    begin = len(body)
    whole = bytearray(bytes(body) + section)
    pages = -(-len(whole) // PAYLOAD)
    physical = begin // PAYLOAD * PAGE + begin % PAYLOAD
    struct.pack_into("<QQQ", whole, 16, pages * PAGE, physical, len(section))
    if rng.random() < 0.1:
        struct.pack_into("<Q", whole, rng.choice((8, 16, 24, 32, 40)), rng.choice(_LONG_SIZES))
    return paged(bytes(whole))


def packed(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """A file in gzip, xz or bzip2: another content, damage of the packing, or very much of it."""
    plain = gzip.decompress(data)
    pack = rng.choice((gzip.compress, gzip.compress, lzma.compress, bz2.compress))
    kind = rng.random()
    if kind < 0.6:
        return pack(text(plain, rng, [gzip.decompress(o) for o in others]))
    if kind < 0.95:
        return binary(pack(plain), rng, ())
    piece = rng.choice((b"0 ", b"\n", b"1 2 3\n", b"\x00", plain[-200:]))
    return pack(plain + piece * (rng.choice((10**5, 10**6, 4 * 10**6)) // len(piece)))


def zipped(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """An ``.npz`` file: its arrays with other headers, or raw damage."""
    if not data.startswith(b"PK") or rng.random() < 0.4:
        return binary(data, rng, others)
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as source, zipfile.ZipFile(out, "w") as target:
        for info in source.infolist():
            inner = source.read(info)
            if rng.random() < 0.4:
                inner = headed_array(inner, rng, ())
            if rng.random() < 0.95:
                target.writestr(info.filename, inner, zipfile.ZIP_DEFLATED)
    return out.getvalue()


def headed_array(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """An array of numpy: its header of text, and its numbers."""
    end = data.find(b"\n") + 1
    if end < 10 or rng.random() < 0.3:
        return binary(data, rng, others)
    head = text(data[10 : end - 1], rng, ()) + b"\n"
    if rng.random() < 0.8:
        head = head.replace(b"\n", b" ")[: end - 11].ljust(end - 11) + b"\n"
    return data[:8] + struct.pack("<H", len(head) % 65536) + head + data[end:]


#: mutations by the word that readers declare
STYLES: dict[str, Mutation] = {
    "text": text,
    "xml": xml,
    "keyed": keyed,
    "binary": binary,
    "headed": headed,
    "las": las,
    "e57": e57,
    "packed": packed,
    "zipped": zipped,
    "array": headed_array,
}
