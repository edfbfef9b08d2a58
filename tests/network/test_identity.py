"""Ids of observations: unique, and the same however the network came about."""

from pathlib import Path

import numpy as np

import tribrach as tb
from tests.network.networks import scanner_network, trilateration
from tribrach.io.survey.formats import read_files
from tribrach.network.network import Datum, Network
from tribrach.observations.base import Use
from tribrach.observations.sights import Distances

POINTS = "point,e_m,n_m,u_m,role\nA,0,0,0,fixed\nB,100,0,0,fixed\n"
HEAD = "from,to,horizontal_distance_m,sigma_horizontal_distance_mm\n"
SIGHTS = (
    HEAD + "A,P,70.712,2\nA,Q,70.709,2\nB,P,70.710,2\nB,Q,70.711,2\nA,P,70.713,2\nP,Q,100.001,2\n"
)
SECOND = HEAD + "A,P,70.711,2\nB,P,70.712,2\nB,Q,70.712,2\n"
PROJECT = """title = "ids"
[[points]]
file = "points.csv"
[[observations]]
file = "day1/sights.csv"
[[observations]]
file = "day2/sights.csv"
"""


GAMA = """<gama-local><network axes-xy="en"><points-observations>
<point id="{start}" adj="xy"/><point id="{end}" adj="xy"/>
<obs><distance from="{start}" to="{end}" val="70.712" stdev="2"/></obs>
</points-observations></network></gama-local>
"""


def ids_of(network: Network) -> list[str]:
    return [identity for ids in network.ids for identity in ids]


def by_value(network: Network) -> dict[str, float]:
    return {
        identity: value
        for ids, o in zip(network.ids, network.observations, strict=True)
        for identity, value in zip(ids, o.values[:, 0], strict=True)
    }


def job(folder: Path) -> list[Path]:
    for day, text in (("day1", SIGHTS), ("day2", SECOND)):
        (folder / day).mkdir()
        (folder / day / "sights.csv").write_text(text)
    (folder / "points.csv").write_text(POINTS)
    (folder / "job.toml").write_text(PROJECT)
    return [folder / "points.csv", folder / "day1/sights.csv", folder / "day2/sights.csv"]


def test_an_id_says_kind_ends_file_and_number(tmp_path: Path) -> None:
    points, sights, _ = job(tmp_path)
    network = read_files([points, sights]).network()
    assert by_value(network) == {
        "horizontal_distance:A:P:sights.csv:1": 70.712,
        "horizontal_distance:A:Q:sights.csv:1": 70.709,
        "horizontal_distance:B:P:sights.csv:1": 70.710,
        "horizontal_distance:B:Q:sights.csv:1": 70.711,
        "horizontal_distance:A:P:sights.csv:2": 70.713,
        "horizontal_distance:P:Q:sights.csv:1": 100.001,
    }


def test_files_of_one_name_are_told_apart_by_their_folders(tmp_path: Path) -> None:
    network = read_files(job(tmp_path)).network()
    values = by_value(network)
    assert values["horizontal_distance:A:P:day1/sights.csv:1"] == 70.712
    assert values["horizontal_distance:A:P:day2/sights.csv:1"] == 70.711
    assert len(values) == network.count() == 9
    sources = {str(s) for o in network.observations for s in o.source}
    assert {"day1/sights.csv:2", "day2/sights.csv:2"} <= sources


def test_files_of_gama_are_told_apart_too(tmp_path: Path) -> None:
    files = []
    for day, start, end in (("day1", "A", "P"), ("day2", "C", "Q")):
        (tmp_path / day).mkdir()
        files.append(tmp_path / day / "net.gkf")
        files[-1].write_text(GAMA.format(start=start, end=end))
    for order in (files, files[::-1]):
        assert set(ids_of(read_files(order).network())) == {
            "horizontal_distance:A:P:day1/net.gkf:1",
            "horizontal_distance:C:Q:day2/net.gkf:1",
        }


def test_ids_do_not_depend_on_the_order_of_files_or_on_who_reads_them(tmp_path: Path) -> None:
    points, first, second = job(tmp_path)
    values = by_value(read_files([points, first, second]).network())
    assert by_value(read_files([second, first, points]).network()) == values
    assert by_value(tb.open_job(tmp_path / "job.toml").network()) == values


def test_ids_do_not_depend_on_what_is_switched_off(tmp_path: Path) -> None:
    job(tmp_path)
    network = tb.open_job(tmp_path / "job.toml").network()
    (table,) = (t for t, o in enumerate(network.observations) if o.kind == "horizontal_distance")
    fewer = network.switched([(table, 0)], Use.OFF, "prism tilted")
    assert ids_of(fewer) == ids_of(network)
    assert ids_of(network.with_datum(Datum("free"))) == ids_of(network)
    assert ids_of(tb.adjust(network).network) == ids_of(network)


def test_colons_in_names_do_not_make_two_ids_one() -> None:
    survey = trilateration(Datum("free"))
    survey.point("1:P", (0.0, 0.0, 0.0))
    survey.add(Distances, values=[170.0, 100.0], sigma=0.01, start=["1:P", "1"], end=["2", "P:2"])
    names = ids_of(survey.network())
    assert r"distance:1\:P:2::1" in names
    assert r"distance:1:P\:2::1" in names


def test_constraints_and_observations_share_no_id() -> None:
    survey = trilateration(Datum("free"))
    survey.add(Distances, values=[100.0], sigma=0.01, start=["1"], end=["P"])
    survey.add(Distances, values=[100.0], hard=True, start=["1"], end=["P"])
    network = survey.network()
    assert ids_of(network).count("distance:1:P::1") == 1
    assert "distance:1:P::2" not in ids_of(network)


def test_every_observation_of_stations_has_one_id() -> None:
    network = scanner_network(np.random.default_rng(3))[0].network()
    names = ids_of(network)
    assert len(set(names)) == len(names) == sum(len(o) for o in network.observations)
    assert "target_centre:S0:T3::1" in names
