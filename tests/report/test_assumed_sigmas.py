"""Sigmas that nobody stated are called assumed on the first page, and no verdict is green."""

from pathlib import Path

import pytest

from tests.report.test_flat_site import adjusted
from tribrach.report.front_page import front_page
from tribrach.report.text import brief

RADIUS = "curvature_radius_m = 6371000.0\n"


@pytest.mark.parametrize("source", ["", "the office, June", "assumed by tribrach init"])
def test_control_of_assumed_weight_is_called_so(tmp_path: Path, source: str) -> None:
    content = adjusted(tmp_path, 3.0, RADIUS, f'sigma_source = "{source}"\n')
    front = front_page(content)
    assumed = source.startswith("assumed")
    assert content.summary.test.accepted
    assert front.sort == ("look" if assumed else "good")
    assert ("assumed" in content.datum.sentence) == assumed
    assert any("assumed" in text for text in content.warnings[: content.grave]) == assumed
    assert ("assumed" in brief(content)) == assumed


def test_instruments_that_nobody_named_are_called_so(tmp_path: Path) -> None:
    """As ``init`` writes them."""
    figures = "distance_mm = 2.0\n"
    for source, grave in (("assumed by tribrach init", 1), ("the sheet of 2019", 0)):
        own = f'[instruments.total_station]\n{figures}source = "{source}"\n'
        content = adjusted(tmp_path, 3.0, RADIUS + own)
        assert content.grave == grave
        assert front_page(content).sort == ("look" if grave else "good")
