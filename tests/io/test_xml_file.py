"""XML is read without entities, networks and foreign files."""

import os

import pytest

from tribrach.errors import InputError
from tribrach.io import xml_file


@pytest.fixture
def load(tmp_path):
    """Load bytes as a file with root ``a``."""

    def read(data: bytes):
        path = tmp_path / "file.xml"
        path.write_bytes(data)
        return xml_file.load(path, "a")

    return read


def test_lines_are_known(load):
    root = load(b"<?xml version='1.0'?>\n<!-- c -->\n<a>\n<b/>\n</a>")
    assert xml_file.line_of(root) == 3
    assert xml_file.line_of(root[0]) == 4


def test_blank_lines_before_the_declaration_keep_the_numbers_of_lines(load):
    root = load(b"\n \n<?xml version='1.0'?>\n<a>\n<b/></a>")
    assert xml_file.line_of(root[0]) == 5


WIDE = '<?xml version="1.0" encoding="UTF-16"?><!DOCTYPE a [<!ENTITY l "l">]><a/>'
BAD = {
    "entities": b'<!DOCTYPE a [\n<!ENTITY lol "lol">\n]>\n<a>&lol;</a>',
    "file entity": b'<!DOCTYPE a [<!ENTITY f SYSTEM "file:///etc/passwd">]><a>&f;</a>',
    "wide entities": WIDE.encode("utf-16"),
    "not closed": b"<a>",
    "wrong bytes": b'<?xml version="1.0" encoding="UTF-8"?>\n<a>\xff\xfe</a>',
    "unknown encoding": b'<?xml version="1.0" encoding="klingon"?><a/>',
    "other root": b"<b/>",
    "empty": b" \n",
    "text": b"hello",
}


@pytest.mark.parametrize("case", BAD)
def test_bad_files_are_one_sentence(load, case):
    with pytest.raises(InputError) as caught:
        load(BAD[case])
    text = str(caught.value)
    assert "file.xml" in text
    assert "\n" not in text
    assert "passwd" not in text


def test_entity_line(load):
    with pytest.raises(InputError, match=r"file.xml:2: the XML declares entities"):
        load(BAD["entities"])


def test_undeclared_entities_of_an_external_dtd_are_not_fetched(load, tmp_path):
    (tmp_path / "x.dtd").write_text('<!ENTITY f "from the DTD">')
    root = load(b'<!DOCTYPE a SYSTEM "x.dtd"><a>ok</a>')
    assert root.text == "ok"


def test_size_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(xml_file, "MAX_BYTES", 10)
    path = tmp_path / "file.xml"
    path.write_bytes(b"<a></a>      ")
    with pytest.raises(InputError, match="more than 1e-05 MB"):
        xml_file.load(path, "a")


def test_absent_file(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        xml_file.load(tmp_path / "none.xml", "a")
    with pytest.raises(InputError, match="cannot be read"):
        xml_file.load(tmp_path, "a")
    assert os.sep in str(tmp_path)
