"""edits.toml: what is written is read as the same, and bad files end in one sentence."""

import datetime
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tribrach.errors import InputError
from tribrach.project.edits import (
    Edits,
    ObservationEdit,
    RoleEdit,
    TargetEdit,
    edits_text,
    read_edits,
)

WORDS = st.text(
    st.characters(exclude_characters="\0", exclude_categories=["Cs"]), min_size=1, max_size=12
)
REASON = WORDS.filter(str.strip)
MOMENT = st.none() | st.dates() | st.datetimes(timezones=st.none() | st.just(datetime.UTC))
REST = {"reason": REASON, "by": WORDS | st.just(""), "at": MOMENT}
NUMBER = st.floats(-1e4, 1e4)
EDITS = st.builds(
    Edits,
    edit=st.lists(
        st.builds(
            ObservationEdit,
            observation=WORDS,
            use=st.sampled_from(["off", "check", "active"]),
            **REST,
        ),
        unique_by=lambda e: e.observation,
        max_size=3,
    ).map(tuple),
    role=st.lists(
        st.builds(
            RoleEdit, point=WORDS, role=st.sampled_from(["control", "check", "free"]), **REST
        ),
        unique_by=lambda e: e.point,
        max_size=2,
    ).map(tuple),
    target=st.lists(
        st.builds(
            TargetEdit, scan=WORDS, center=st.tuples(NUMBER, NUMBER, NUMBER), name=WORDS, **REST
        )
        | st.builds(
            TargetEdit,
            scan=WORDS,
            center=st.tuples(NUMBER, NUMBER, NUMBER),
            accept=st.just(False),
            **REST,
        ),
        unique_by=lambda e: f"{e.scan} {e.center}",
        max_size=2,
    ).map(tuple),
)


@settings(deadline=None, max_examples=50, suppress_health_check=[HealthCheck.too_slow])
@given(EDITS)
def test_what_is_written_is_read_as_the_same(
    tmp_path_factory: pytest.TempPathFactory, edits: Edits
) -> None:
    path = tmp_path_factory.mktemp("edits") / "edits.toml"
    path.write_text(edits_text(edits), encoding="utf-8", newline="\n")
    assert read_edits(path).model_dump() == edits.model_dump()


ONE = '[[edit]]\nobservation = "a"\nuse = "off"\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (ONE, r"edits.toml:1: key edit.reason is missing"),
        (ONE + 'reason = "  "\n', r"edits.toml:4: edit.reason: say why"),
        (ONE + 'reason = "x"\nwhy = "y"\n', r"edits.toml:5: key edit.why is unknown"),
        (ONE.replace("off", "of") + 'reason = "x"\n', r"edits.toml:3: edit.use is 'of'"),
        (ONE + 'reason = "x"\nat = 12\n', r"edits.toml:5: "),
        (2 * (ONE + 'reason = "x"\n'), r"edits.toml:5 \(edit 2\): a is decided twice"),
        ('[[target]]\nscan = "S"\ncenter = [1, 2, 3]\nreason = "x"\n', "give the name"),
        ('[[target]]\nscan = "S"\ncenter = [1, nan, 3]\nname = "T"\nreason = "x"\n', "beyond any"),
        ('[[role]]\npoint = "A"\nrole = "fixed"\nreason = "x"\n', r"edits.toml:3: role.role"),
        ("[[edit]\n", "not TOML"),
        ('edit = "a"\n', "edits.toml:1: edit is 'a'"),
    ],
)
def test_bad_files_end_in_a_sentence(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "edits.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        read_edits(path)
