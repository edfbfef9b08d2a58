"""Reports of real networks: every one renders, strictly and with all its rows."""

import json
from pathlib import Path

import pytest
from lxml import html as parser

from tribrach.io.survey.formats import read_files
from tribrach.network.adjustment import adjust
from tribrach.network.quality import assess
from tribrach.report import html, json_result, text
from tribrach.report.build import build

NETWORKS = [
    "networks/gama/krumm-1d/Niemeier_Height_free.gkf",
    "networks/gama/krumm-2d/Ghilani15_4_Angle_fix.gkf",
    "networks/gama/misc/gama-local.gkf",
    "networks/gama/misc/cube-1.gkf",
    "networks/gama/misc/minimal.gkf",
    "scans/riegl_project/project.rsp",
]


@pytest.mark.data
@pytest.mark.parametrize("name", NETWORKS)
def test_real_networks_render(shared_data: Path, name: str) -> None:
    adjustment = adjust(read_files([shared_data / name]).network())
    content = build(adjustment, assess(adjustment))
    count = adjustment.network.count()
    assert len(content.observations) == count
    data = json.loads(json_result.dumps(content), parse_constant=lambda word: pytest.fail(word))
    assert len(data["observations"]) == count
    tree = parser.document_fromstring(html.render(content))
    assert len(tree.xpath("//section[@id='observations']//tbody/tr")) == count
    printed = text.render(content)
    assert "nan" not in printed.lower().split()
    assert max(map(len, printed.splitlines())) < 200
    for point in content.points:
        assert point.name in printed
