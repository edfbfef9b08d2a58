"""A page on paper has the words and figures of the page, and carries its JSON."""

import hashlib
from pathlib import Path

import pikepdf
import pytest
from lxml import html
from typer.testing import CliRunner

from tests.seal.test_seal import job
from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.io.paper import paper_of

RUN = CliRunner()


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of results with its document."""
    project = job(tmp_path_factory.mktemp("job"))
    done = RUN.invoke(app, ["run", str(project), "-q"])
    assert done.exit_code == 0, done.output
    done = RUN.invoke(app, ["pdf", str(project.parent)])
    assert done.exit_code == 0, done.output
    return project.parent / "out"


def test_every_figure_of_the_page_is_in_the_document(run: Path) -> None:
    page = (run / "report.html").read_text()
    source = paper_of(page).source
    cells = html.document_fromstring(page).findall(".//td")
    texts = {" ".join(cell.text_content().split()) for cell in cells if not len(cell)}
    assert len(texts) > 50
    assert {text for text in texts if f'"{text}"' not in source} == set()


def test_the_document_is_pdf_a_3_with_json_bookmarks_and_a_field(run: Path) -> None:
    with pikepdf.open(run / "report.pdf") as pdf:
        with pdf.open_metadata() as metadata:
            assert metadata["pdfaid:part"] == "3"
            assert metadata["pdfaid:conformance"] == "B"
        assert pdf.Root.OutputIntents[0].S == "/GTS_PDFA1"
        assert list(pdf.attachments) == ["result.json"]
        carried = pdf.attachments["result.json"].get_file().read_bytes()
        assert carried == (run / "result.json").read_bytes()
        assert pdf.Root.AF[0].AFRelationship == "/Data"
        fields = pdf.Root.AcroForm.Fields
        assert [(one.FT, str(one.T)) for one in fields] == [("/Sig", "Signature")]
        with pdf.open_outline() as outline:
            assert len(list(outline.root)) >= 1
        assert len(pdf.pages) >= 2


def test_the_same_page_gives_the_same_document(run: Path) -> None:
    def source() -> str:
        paper = paper_of((run / "report.html").read_text(), ("result.json",))
        parts = [paper.source.encode(), *paper.files.values()]
        return hashlib.sha256(b"".join(parts)).hexdigest()

    assert source() == source()


@pytest.mark.parametrize(
    "text", ["", "x", "<html></html>", "<h1>Tribrach</h1>" * 3, "\0", "<svg viewBox='a b'></svg>"]
)
def test_what_is_no_page_is_refused_or_set(tmp_path: Path, text: str) -> None:
    (tmp_path / "x.html").write_text(text)
    done = RUN.invoke(app, ["pdf", str(tmp_path / "x.html")])
    assert done.exit_code in (0, 2)
    assert "Traceback" not in done.output
    assert (tmp_path / "x.pdf").exists() == (done.exit_code == 0)


def test_text_that_looks_like_code_stays_text() -> None:
    page = '<p>Tribrach</p><h1>#eval("1") \\ "x" $a$ [b]</h1><table><tr><td>#{1}</td></tr></table>'
    source = paper_of(page).source
    assert '#heading(level: 1, "#eval(\\"1\\") \\\\ \\"x\\" $a$ [b]")' in source
    assert '[#"#{1}"]' in source
    with pytest.raises(InputError):
        paper_of("<p>nothing</p>")
