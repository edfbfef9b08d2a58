"""Networks of other programs read from their files, and the JSON result written.

The peer of the reader of GNU Gama looks at the same file without understanding it: lxml and the
attributes of every element. STAR*NET is measured by its growth. The peer of the JSON result is
the ``json`` of Python, given the same data.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

from lxml import etree

from benchmarks.figures import Figure, Growth, cost_of, run
from benchmarks.network_files import write_grid
from tribrach.io.survey.formats import read_files
from tribrach.network.network import Network
from tribrach.network.survey import observed_part
from tribrach.report import json_result
from tribrach.solution import AdjustmentSettings, adjust_network


def network_of(path: Path) -> Network:
    """The network of a file, ready to be adjusted."""
    return observed_part(read_files([path])).network()


def elements(path: Path) -> int:
    """All attributes of all elements of an XML file, by lxml; how many there are."""
    return sum(len(dict(node.attrib)) for node in etree.parse(path).iter(etree.Element))


def measure(*sides: float) -> Iterator[Figure | Growth]:
    """Grids of these sides, written before in each format; the result of the smallest."""
    with tempfile.TemporaryDirectory() as folder:
        network = None
        for title, suffix in (("GNU Gama", ".gkf"), ("STAR*NET", ".dat")):
            seconds = []
            for side in map(int, sides):
                path = Path(folder) / f"grid{side}{suffix}"
                count = write_grid(side, path)
                network_of(path)
                read, ours = cost_of(lambda path=path: network_of(path), repeats=2)
                network = network or read
                if suffix == ".gkf":
                    _, theirs = cost_of(lambda path=path: elements(path), repeats=2)
                    told = f"{read.count()} of {count} values"
                    what, peer = f"network read, {title}", "lxml, its attributes"
                    yield Figure(what, f"{side} x {side}", ours, peer, theirs, told)
                seconds.append(ours.processor)
            points = tuple(float(side) ** 2 for side in sides)
            yield Growth(f"network read, {title}", "points", points, tuple(seconds))
        assert network is not None
        content = adjust_network(network, AdjustmentSettings())
        text, ours = cost_of(lambda: "".join(json_result.pieces(content)), repeats=3)
        data = json.loads(text)
        again, theirs = cost_of(lambda: json.dumps(data, indent=1), repeats=3)
        told = "same data" if json.loads(again) == data else "other data"
        size = f"{len(data['observations'])} values, {len(text) / 1e6:.0f} MB"
        yield Figure("JSON result written", size, ours, "json of Python", theirs, told)


if __name__ == "__main__":
    run(measure, full=(45, 71, 141), small=(15, 30))
