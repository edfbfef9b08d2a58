"""A sealed job holds what was measured and what came of it, and shows every change."""

import hashlib
import json
import stat
import zipfile
from collections.abc import Callable, Mapping
from datetime import UTC, datetime, timedelta
from pathlib import Path

import bagit
import numpy as np
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID
from typer.testing import CliRunner

from tribrach.cli import app

PROJECT = """title = "Network"
[site]
kind = "flat"
[instruments.TS]
direction_arcsec = 3
zenith_arcsec = 3
distance_mm = 1
distance_ppm = 1
[[points]]
file = "../lists/control.csv"
role = "control"
[[observations]]
file = "field/obs.csv"
instrument = "TS"
"""
CONTROL = {"A": (100.0, 100.0, 10.0), "B": (200.0, 100.0, 10.5), "C": (150.0, 190.0, 11.0)}
STATION = np.array([150.0, 130.0, 10.2])


def job(folder: Path) -> Path:
    """A free station with three control points, whose list stands beside the folder of the job."""
    generator = np.random.default_rng(1)
    rows = ["from,to,direction_gon,zenith_gon,slope_distance_m"]
    for name, place in CONTROL.items():
        e, n, u = np.subtract(place, STATION)
        angles = np.array([np.arctan2(e, n) - 1.0, np.arctan2(np.hypot(e, n), u)])
        hz, v = (angles % (2 * np.pi) + 1e-5 * generator.normal(size=2)) * 200 / np.pi
        distance = np.linalg.norm([e, n, u]) + 1e-3 * generator.normal()
        rows.append(f"P,{name},{hz:.5f},{v:.5f},{distance:.4f}")
    control = ["point,E_m,N_m,U_m,sigma_e_mm,sigma_n_mm,sigma_u_mm"]
    control += [f"{name},{e},{n},{u},2,2,2" for name, (e, n, u) in CONTROL.items()]
    texts = {
        "net/job.toml": PROJECT,
        "lists/control.csv": "\n".join(control) + "\n",
        "net/field/obs.csv": "\n".join(rows) + "\n",
    }
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder / "net" / "job.toml"


def tribrach(*words: object, status: int = 0) -> str:
    done = CliRunner().invoke(app, [str(word) for word in words])
    assert done.exit_code == status, done.output
    assert "Traceback" not in done.output
    return done.output


def verified(seal: Path, *words: object, status: int = 0) -> dict:
    out = seal.with_suffix(".json")
    tribrach("verify", seal, "--json", out, *words, status=status)
    return json.loads(out.read_text())


@pytest.fixture(scope="module")
def sealed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A job that was run, sealed with edits, not signed."""
    project = job(tmp_path_factory.mktemp("job"))
    edits = '[[edit]]\nobservation = "slope_distance:P:A:obs.csv:1"\nuse = "check"\n'
    edits += 'reason = "bubble"\n'
    (project.parent / "edits.toml").write_text(edits)
    tribrach("run", project, "-q")
    tribrach("seal", project.parent, "--json", project.parent / "seal.json")
    return project.with_name("job.seal.zip")


def rewritten(
    seal: Path,
    to: Path,
    change: Mapping[str, Callable[[bytes], bytes]] | None = None,
    listed: bool = False,
    extra: Mapping[str, bytes] | None = None,
    without: str = "",
) -> Path:
    """The seal with other contents, and, if it is listed, with lists that agree."""
    with zipfile.ZipFile(seal) as archive:
        files = {
            one: archive.read(one)
            for one in archive.namelist()
            if not one.endswith(without or "\0")
        }
    for name, edit in (change or {}).items():
        assert edit(files[name]) != files[name]
        files[name] = edit(files[name])
    files |= extra or {}
    root = next(iter(files)).split("/")[0]
    if listed:
        for name, prefix in (("manifest-sha256.txt", "data/"), ("tagmanifest-sha256.txt", "")):
            rows = []
            for line in files[f"{root}/{name}"].decode().splitlines():
                path = line.split("  ", 1)[1]
                rows.append(f"{hashlib.sha256(files[f'{root}/{path}']).hexdigest()}  {path}\n")
            files[f"{root}/{name}"] = "".join(rows).encode()
            assert prefix == "" or all(prefix in row for row in rows)
    with zipfile.ZipFile(to, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return to


def flipped(at: bytes) -> Callable[[bytes], bytes]:
    """Change one byte behind a text."""

    def edit(data: bytes) -> bytes:
        k = data.index(at) + len(at)
        return data[:k] + bytes([data[k] ^ 1]) + data[k + 1 :]

    return edit


def test_a_job_is_sealed_and_verified(sealed: Path) -> None:
    said = json.loads((sealed.parent / "seal.json").read_text())
    assert {"net/job.toml", "lists/control.csv", "net/field/obs.csv", "net/edits.toml"} == set(
        said["inputs"]
    )
    assert {"net/out/report.html", "net/out/result.json"} < set(said["results"])
    assert said["reproduced"]
    assert said["certificate"] == ""
    found = verified(sealed)
    assert found["whole"]
    assert found["holds"]
    assert found["files"] == found["reproduced"] == found["figures"] == []
    assert found["signature"] is None
    assert found["run_again"]
    assert found["versions"] == {}


def test_another_program_finds_the_bag_valid(sealed: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(sealed) as archive:
        archive.extractall(tmp_path)
    bag = bagit.Bag(str(tmp_path / "job"))
    assert bag.is_valid()
    assert bag.info["External-Description"] == "Network"


@pytest.mark.parametrize(
    ("name", "at"),
    [
        ("data/net/field/obs.csv", b"P,A,"),
        ("data/net/edits.toml", b'reason = "'),
        ("data/net/out/report.html", b"Network"),
        ("data/net/out/result.json", b'"title"'),
        ("seal.json", b'"python": "3'),
        ("bag-info.txt", b"tribrach "),
    ],
)
def test_a_changed_byte_is_named(sealed: Path, tmp_path: Path, name: str, at: bytes) -> None:
    changed = rewritten(sealed, tmp_path / "x.zip", {f"job/{name}": flipped(at)})
    found = verified(changed, "--no-run", status=2)
    assert not found["whole"]
    assert found["files"] == [{"name": name, "what": "changed"}]


def test_files_that_are_missing_or_more_are_named(sealed: Path, tmp_path: Path) -> None:
    more = rewritten(sealed, tmp_path / "a.zip", extra={"job/data/net/further.csv": b"x"})
    found = verified(more, "--no-run", status=2)
    assert found["files"] == [{"name": "data/net/further.csv", "what": "not listed"}]
    less = rewritten(sealed, tmp_path / "b.zip", without="report.txt")
    found = verified(less, "--no-run", status=2)
    assert found["files"] == [{"name": "data/net/out/report.txt", "what": "missing"}]


def test_a_forged_figure_with_lists_that_agree_is_found_by_the_run(
    sealed: Path, tmp_path: Path
) -> None:
    result = "job/data/net/out/result.json"

    def other(data: bytes) -> bytes:
        document = json.loads(data)
        document["points"]["P"]["xyz"][0] += 0.05
        document["sigma0"]["global_test"]["accepted"] ^= True
        return json.dumps(document).encode()

    forged = rewritten(sealed, tmp_path / "x.zip", {result: other}, listed=True)
    found = verified(forged, status=2)
    assert found["whole"]
    assert not found["holds"]
    assert [one["name"] for one in found["reproduced"]] == ["net/out/result.json"]
    figures = {one["place"]: one for one in found["figures"]}
    assert set(figures) == {"points/P/xyz/0", "sigma0/global_test/accepted"}
    assert figures["points/P/xyz/0"]["sigmas"] > 10
    assert figures["sigma0/global_test/accepted"]["verdict"]
    assert not figures["points/P/xyz/0"]["verdict"]


def certificate(folder: Path) -> tuple[Path, Path]:
    """A key and a certificate that signs itself."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "A Surveyor")])
    now = datetime.now(UTC)
    usage = x509.KeyUsage(True, True, False, False, False, True, False, False, False)
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(days=1))
        .not_valid_after(now + timedelta(days=9))
        .add_extension(usage, critical=True)
        .add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
        .sign(key, hashes.SHA256())
    )
    paths = folder / "own.pem", folder / "key.pem"
    paths[0].write_bytes(made.public_bytes(serialization.Encoding.PEM))
    secret = serialization.BestAvailableEncryption(b"secret")
    form = serialization.PrivateFormat.PKCS8
    paths[1].write_bytes(key.private_bytes(serialization.Encoding.PEM, form, secret))
    return paths


def test_a_signature_is_of_these_files_and_of_this_surveyor(
    sealed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine, key = certificate(tmp_path)
    out, project = tmp_path / "signed.zip", sealed.parent / "job.toml"
    words = ["seal", project, "--out", out, "--certificate", mine, "--key", key, "--no-check"]
    tribrach(*words, status=2)  # no passphrase
    assert not out.exists()
    monkeypatch.setenv("TRIBRACH_PASSPHRASE", "secret")
    tribrach(*words)
    found = verified(out, "--no-run")
    assert found["signature"]["valid"]
    assert not found["signature"]["trusted"]
    assert "A Surveyor" in found["signature"]["signer"]
    assert verified(out, "--no-run", "--trust", mine)["signature"]["trusted"]
    # who changes a file and all lists cannot sign them
    change = {"job/data/net/out/report.txt": lambda data: data + b"!"}
    forged = rewritten(out, tmp_path / "forged.zip", change, listed=True)
    found = verified(forged, "--no-run", "--trust", mine, status=2)
    assert found["files"] == []
    assert not found["signature"]["valid"]
    assert not found["whole"]
    damaged = rewritten(out, tmp_path / "damaged.zip", {"job/signature.p7s": lambda d: d[:99]})
    assert not verified(damaged, "--no-run", status=2)["signature"]["valid"]


def test_what_was_not_run_as_it_stands_is_not_sealed(tmp_path: Path) -> None:
    project = job(tmp_path)
    tribrach("seal", project, status=2)  # no results
    tribrach("run", project, "-q")
    report = project.parent / "out" / "report.txt"
    kept = report.read_text()
    report.write_text(kept + "!")
    tribrach("seal", project, status=2)
    report.write_text(kept)
    tribrach("seal", project)
    # an input that changed after the run
    observed = project.parent / "field" / "obs.csv"
    observed.write_text(observed.read_text().replace("P,B,", "P,B,0"))
    obs = observed.read_text().splitlines()
    obs[3] = obs[3][:-1] + ("1" if obs[3][-1] != "1" else "2")
    observed.write_text("\n".join(obs) + "\n")
    before = project.with_name("job.seal.zip").read_bytes()
    tribrach("seal", project, status=2)
    assert project.with_name("job.seal.zip").read_bytes() == before
    # a place on this machine
    project.write_text(PROJECT.replace("../lists", str(tmp_path / "lists")))
    tribrach("run", project, "-q")
    tribrach("seal", project, status=2)


def link(archive: zipfile.ZipFile, name: str) -> None:
    one = zipfile.ZipInfo(name)
    one.external_attr = (stat.S_IFLNK | 0o777) << 16
    archive.writestr(one, "/etc/passwd")


@pytest.mark.parametrize(
    "harm",
    [
        lambda archive: archive.writestr("job/data/../../../evil.txt", "x"),
        lambda archive: archive.writestr("/evil.txt", "x"),
        lambda archive: archive.writestr("job/data/C:evil.txt", "x"),
        lambda archive: archive.writestr("job/data\\..\\evil.txt", "x"),
        lambda archive: link(archive, "job/data/net/link"),
        lambda archive: archive.writestr("job/data/bomb", b"\0" * 50_000_000),
        lambda archive: archive.writestr("job/data/NET/JOB.TOML", "x"),
        lambda archive: archive.writestr("other/data/x", "x"),
    ],
)
def test_a_seal_that_would_do_harm_is_refused(
    sealed: Path, tmp_path: Path, harm: Callable[[zipfile.ZipFile], None]
) -> None:
    bad = tmp_path / "bad" / "x.zip"
    bad.parent.mkdir()
    bad.write_bytes(sealed.read_bytes())
    with zipfile.ZipFile(bad, "a", zipfile.ZIP_DEFLATED) as archive:
        harm(archive)
    tribrach("verify", bad, status=2)
    assert [one.name for one in tmp_path.rglob("*") if one.is_file()] == ["x.zip"]


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", b"not a zip file", b"\0" * 1000])
def test_what_is_no_seal_is_refused(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "x.zip").write_bytes(data)
    tribrach("verify", tmp_path / "x.zip", status=2)


def test_damage_anywhere_is_a_sentence_or_named(sealed: Path, tmp_path: Path) -> None:
    data, generator = sealed.read_bytes(), np.random.default_rng(1)
    bad = tmp_path / "x.zip"
    for at in generator.integers(0, len(data), 60):
        bad.write_bytes(data[:at] + bytes([data[at] ^ 0xFF]) + data[at + 1 :])
        done = CliRunner().invoke(app, ["verify", str(bad), "--no-run"])
        assert done.exit_code in (0, 2), done.output
        assert "Traceback" not in done.output
    bad.write_bytes(data[: len(data) // 2])
    tribrach("verify", bad, status=2)


def test_a_seal_that_names_files_of_the_machine_is_not_run(sealed: Path, tmp_path: Path) -> None:
    """The project in a seal of somebody else must not read what is not in it."""
    (tmp_path / "private.csv").write_text("point,E_m,N_m,U_m\nA,1,2,3\n")
    change = {
        "job/data/net/job.toml": lambda data: data.replace(
            b"../lists/control.csv", str(tmp_path / "private.csv").encode()
        )
    }
    found = verified(rewritten(sealed, tmp_path / "x.zip", change, listed=True))
    assert not found["run_again"]
    assert not found["holds"]


def test_a_file_beside_the_seal_must_be_the_one_that_was_sealed(
    sealed: Path, tmp_path: Path
) -> None:
    """What is only named by its digest is asked for, and compared."""
    name = "net/field/obs.csv"
    with zipfile.ZipFile(sealed) as archive:
        data = archive.read(f"job/data/{name}")
    fetch = f"ni:///sha-256;{'x' * 43} {len(data)} data/{name}\n".encode()
    lean = rewritten(sealed, tmp_path / "x.zip", without=name, extra={"job/fetch.txt": fetch})
    with zipfile.ZipFile(lean) as archive:
        files = {one: archive.read(one) for one in archive.namelist()}
    tags = files["job/tagmanifest-sha256.txt"].decode()
    tags += f"{hashlib.sha256(fetch).hexdigest()}  fetch.txt\n"
    lean = rewritten(
        lean, tmp_path / "y.zip", {"job/tagmanifest-sha256.txt": lambda _: tags.encode()}
    )
    found = verified(lean)
    assert found["whole"]
    assert not found["run_again"]
    place = tmp_path / "beside" / name
    place.parent.mkdir(parents=True)
    place.write_bytes(data)
    assert verified(lean, "--inputs", tmp_path / "beside")["holds"]
    place.write_bytes(data.replace(b"P,A", b"P,B"))
    found = verified(lean, "--inputs", tmp_path / "beside", status=2)
    assert found["files"] == [{"name": name, "what": "changed"}]
    assert not found["run_again"]


def test_what_seal_json_leaves_out_is_compared_all_the_same(sealed: Path, tmp_path: Path) -> None:
    def silent(data: bytes) -> bytes:
        return json.dumps(json.loads(data) | {"results": []}).encode()

    change = {
        "job/seal.json": silent,
        "job/data/net/out/report.txt": lambda data: data.replace(b"P", b"Q"),
    }
    forged = rewritten(sealed, tmp_path / "x.zip", change, listed=True)
    found = verified(forged, status=2)
    assert [one["name"] for one in found["reproduced"]] == ["net/out/report.txt"]


def test_a_changed_or_damaged_input_is_not_run(sealed: Path, tmp_path: Path) -> None:
    changed = rewritten(
        sealed, tmp_path / "x.zip", {"job/data/net/field/obs.csv": flipped(b"P,A,")}
    )
    found = verified(changed, status=2)
    assert not found["run_again"]
    data = sealed.read_bytes()
    at = data.index(b"net/out/result.json") + 2000
    (tmp_path / "y.zip").write_bytes(data[:at] + bytes([data[at] ^ 0xFF]) + data[at + 1 :])
    found = verified(tmp_path / "y.zip", status=2)
    assert not found["whole"]


@pytest.mark.parametrize("name", ["a:b.csv", "a\\b.csv", "OBS.csv"])
def test_a_name_that_others_cannot_unpack_is_not_sealed(tmp_path: Path, name: str) -> None:
    project = job(tmp_path)
    observed = project.parent / "field"
    (observed / name).write_bytes((observed / "obs.csv").read_bytes())
    more = f"[[observations]]\nfile = 'field/{name}'\ninstrument = \"TS\"\n"
    project.write_text(PROJECT + more)
    tribrach("run", project, "-q")
    tribrach("seal", project, "--no-check", status=2)
    assert not project.with_name("job.seal.zip").exists()
