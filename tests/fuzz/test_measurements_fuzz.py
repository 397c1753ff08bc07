"""The doors of measurements: whatever a file holds, there are measurements or a list of its faults."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.tables.measurements import names_of, read_measurements, students_in
from grader.tables.reader import why_no_id
from grader.texts.spoken import message
from reference.authored.assignment import load_assignment
from reference.errors import InputFileError

NAMES = names_of(load_assignment("pump"))
HEADER = st.lists(
    st.sampled_from(["student_id", "n", "position", "kv", "v_A", "v_A_deg", "omega_3_value", "what", ""]),
    max_size=8,
)
CELLS = st.text(alphabet='s1;,#"\n\r\t\x00 .-eé7', max_size=8)
TREES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["v_A", "v_AA", "omega_3", "kv", "student_id"]), inner, max_size=3)
    ),
    max_leaves=8,
)
DOCUMENTS = st.dictionaries(
    st.sampled_from(
        ["student_id", "n", "position", "scales", "segments_mm", "directions_deg", "values", "schema_version"]
    ),
    TREES,
)


def check(path):
    """Whatever is read can be told and written."""
    try:
        found = read_measurements(path, NAMES)
    except InputFileError:
        assert all(why_no_id(student) is None for student in students_in(path))
        return
    for one in found:
        told = [one.student_id, dict(one.scales), one.numbers, [message(problem) for problem in one.problems]]
        json.dumps(
            [*told, [", ".join(gap.reason.parameters["entries"]) for gap in one.reading.unread]],
            allow_nan=False,
        ).encode()
        assert len(one.problems) <= 22


@given(HEADER, st.lists(st.lists(CELLS, max_size=8), max_size=4), st.sampled_from(",;"))
def test_any_table_is_measurements_or_their_faults(tmp_path_factory, header, rows, delimiter):
    path = tmp_path_factory.mktemp("measured") / "x.csv"
    path.write_text(
        "\n".join(delimiter.join(cells) for cells in [header, *rows]), encoding="utf-8", newline=""
    )
    check(path)


@given(DOCUMENTS, st.booleans())
def test_any_document_is_measurements_or_its_faults(tmp_path_factory, document, is_twice):
    path = tmp_path_factory.mktemp("measured") / "x.json"
    text = json.dumps(document)
    path.write_text(text.replace("}", ',"v_A":1,"v_A":2}') if is_twice else text, encoding="utf-8")
    check(path)


@pytest.mark.parametrize("text", ["{}", '{"segments_mm": {}}'])
def test_an_empty_document_is_one_without_measurements(tmp_path, text):
    (tmp_path / "x.json").write_text(text, encoding="utf-8")
    (one,) = read_measurements(tmp_path / "x.json", NAMES)
    assert one.numbers == {}
