"""A name given by hand to a target, and what it means for what other stations saw there."""

from tribrach.job.decided_targets import with_names

MATCHED = {
    "A": ("tie 1", "P", "tie 2"),
    "B": ("", "tie 2", "tie 1"),
    "C": ("DOOR", "tie 1"),
}


def test_a_tie_point_has_its_name_wherever_it_was_seen() -> None:
    out = with_names(MATCHED, {"A": {0: "GATE"}})
    assert out == {
        "A": ("GATE", "P", "tie 2"),
        "B": ("", "tie 2", "GATE"),
        "C": ("DOOR", "GATE"),
    }


def test_a_station_that_sees_another_target_of_this_name_keeps_both() -> None:
    out = with_names(MATCHED, {"A": {0: "DOOR"}})
    assert out["B"] == ("", "tie 2", "DOOR")
    assert out["C"] == ("DOOR", "tie 1")


def test_sights_with_several_names_are_several_points() -> None:
    out = with_names(MATCHED, {"A": {0: "GATE"}, "B": {2: "POST"}})
    assert out == {
        "A": ("GATE", "P", "tie 2"),
        "B": ("", "tie 2", "POST"),
        "C": ("DOOR", "tie 1"),
    }


def test_a_name_by_hand_is_taken_from_another_target_of_its_station() -> None:
    out = with_names(MATCHED, {"A": {2: "P"}})
    assert out["A"] == ("tie 1", "", "P")
    assert out["B"] == ("", "P", "tie 1")
    assert with_names(MATCHED, {}) == MATCHED
