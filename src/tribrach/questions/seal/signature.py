"""Detached CMS signatures of a seal (RFC 5652), made and read by pyhanko."""

from __future__ import annotations

import asyncio
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tribrach.answers import Result
from tribrach.errors import InputError

if TYPE_CHECKING:
    from pyhanko.sign.signers import Signer

_INSTALL = 'install it: pip install "tribrach[seal]"'


@dataclass(frozen=True)
class Signing:
    """Who signs."""

    certificate: Path  #: the certificate: a .p12 or .pfx with its key, or a PEM file
    #: key of a PEM certificate
    key: Path | None = None
    passphrase: bytes | None = None
    time_server: str | None = None  #: address of a server of time stamps (RFC 3161)


@dataclass(frozen=True)
class Signature(Result):
    """What a signature says."""

    signer: str  #: name in the certificate
    valid: bool  #: is it of these lists, unchanged?
    trusted: bool  #: does the certificate come from an authority that was given?
    time: str = ""  #: of a time stamp, as ISO 8601; "" without one


def _needed() -> None:
    """Refuse where the package is not there."""
    try:
        import pyhanko.sign  # noqa: F401
    except ImportError as error:
        raise InputError("signatures need the package pyhanko", cure=_INSTALL) from error


def _signer(wish: Signing) -> Signer:
    """Who holds the certificate."""
    from pyhanko.sign.signers import SimpleSigner

    for path in filter(None, (wish.certificate, wish.key)):
        if not path.is_file():
            raise InputError("there is no such file", file=path, cure="check its name")
    found: Signer | None
    try:
        if wish.certificate.suffix.lower() in (".p12", ".pfx"):
            found = SimpleSigner.load_pkcs12(  # type: ignore[no-untyped-call]
                str(wish.certificate), passphrase=wish.passphrase
            )
        else:
            key = wish.key or wish.certificate
            found = SimpleSigner.load(  # type: ignore[no-untyped-call]
                str(key), str(wish.certificate), key_passphrase=wish.passphrase
            )
    except Exception:  # what the package raises for a damaged file is not of one kind
        found = None
    if found is None:
        raise InputError(
            "certificate and key cannot be read",
            file=wish.certificate,
            cure="give a .p12 file, or a PEM certificate and --key, and the right passphrase in "
            "TRIBRACH_PASSPHRASE",
        )
    return found


def signed(data: bytes, wish: Signing) -> bytes:
    """Sign a text; the signature apart from it."""
    _needed()
    signer = _signer(wish)
    stamps: Any = None
    if wish.time_server is not None:
        from pyhanko.sign.timestamps import HTTPTimeStamper

        stamps = HTTPTimeStamper(wish.time_server)
    try:
        work = signer.async_sign_general_data(io.BytesIO(data), "sha256", timestamper=stamps)
        made = asyncio.run(work)
    except Exception as error:
        if stamps is None:
            raise
        what = f"the server of time stamps {wish.time_server} does not answer ({error})"
        raise InputError(what, cure="try again, or leave --time-server out") from error
    return bytes(made.dump())


def read_signature(data: bytes, of: bytes, trusted: Sequence[Path] = ()) -> Signature:
    """Test a signature of a text against it."""
    _needed()
    from asn1crypto import cms
    from pyhanko.keys import load_certs_from_pemder
    from pyhanko.sign.validation import async_validate_detached_cms
    from pyhanko_certvalidator import ValidationContext

    try:
        names = [str(path) for path in trusted]
        roots = list(load_certs_from_pemder(names))  # type: ignore[no-untyped-call]
    except Exception as error:
        raise InputError(
            "this certificate cannot be read", file=trusted[0], cure="give PEM or DER files"
        ) from error
    context = ValidationContext(trust_roots=roots, allow_fetching=False)
    try:
        content = cms.ContentInfo.load(data)["content"]
        work = async_validate_detached_cms(
            of, content, signer_validation_context=context, ts_validation_context=context
        )
        status = asyncio.run(work)
    except Exception:  # damaged in any way: it proves nothing
        return Signature("", valid=False, trusted=False)
    stamp = status.timestamp_validity
    time = "" if stamp is None or not stamp.valid else stamp.timestamp.isoformat()
    return Signature(
        status.signing_cert.subject.human_friendly,
        valid=bool(status.intact and status.valid),
        trusted=bool(status.trusted and roots),
        time=time,
    )
