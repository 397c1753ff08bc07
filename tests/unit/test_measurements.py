"""Measurement files: what is understood, and every fault told with its place."""

import json

import pytest

from grader.measurements import names_of, read_measurements
from reference.assignment import load_assignment
from reference.errors import InputFileError

NAMES = names_of(load_assignment("pump"))


@pytest.fixture
def entered(tmp_path):
    """Writes a file and reads it back."""

    def read(content, name="class.csv", names=NAMES):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_measurements(path, names)

    return read


def vector(measurements, name):
    plan = "velocity_plan" if name.startswith("v") else "acceleration_plan"
    return measurements.reading.figures[plan].vectors[name]


def told(measurements):
    return " | ".join(problem.message for problem in measurements.problems)


# CSV ----------------------------------------------------------------------------------------------


def test_a_class_file_is_read_line_by_line(entered):
    first, second = entered(
        "student_id,n,position,kL,kv,ka,v_A,v_A_deg,a_BA_n,v_D_value,omega_3_value\n"
        's01,7,,1:5,"0,185 (m/s)/mm",,60.0,-12,6.5,1.23,-5.5\n'
        "s02,8,,,,,,,,,\n"
    )
    assert (first.student_id, first.n, first.position, first.line) == ("s01", 7, None, 2)
    assert first.scales == {"kL": "1:5", "kv": "0,185 (m/s)/mm"}
    assert vector(first, "v_A").length_mm == 60.0
    assert vector(first, "v_A").direction_deg == 348.0
    assert vector(first, "a_BA_n").direction_deg is None
    assert first.values == {"v_D": 1.23, "omega_3": -5.5}
    assert first.problems == ()
    assert second.reading.figures == {}
    assert second.values == {}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_semicolons_come_with_decimal_commas(entered, encoding):
    text = "student_id;n;v_A;v_B\r\ns01;7,0;60,25;58.5\r\n"
    (one,) = entered(text.encode(encoding))
    assert one.n == 7
    assert vector(one, "v_A").length_mm == 60.25
    assert vector(one, "v_B").length_mm == 58.5


def test_all_faults_of_the_columns_are_told_at_once(entered):
    with pytest.raises(InputFileError) as caught:
        entered("n,v_AA,v_A,v_A,omega_3,colour\n1,2,3,4,5,6\n")
    for part in (
        "student_id is missing",
        "'v_AA'",
        "did you mean",
        "v_A is there 2 times",
        "omega_3_value",
        "'colour'",
    ):
        assert part in caught.value.message


@pytest.mark.parametrize(
    ("cell", "why"),
    [
        ("nan", "no number"),
        ("inf", "no number"),
        ("1e400", "no finite number"),
        ("-3", "from 0 to"),
        ("99999", "from 0 to"),
        ('"12,5"', "write a decimal point"),
        ("sixty", "no number"),
    ],
)
def test_a_bad_number_is_told_with_line_and_column_and_loses_nothing_else(entered, cell, why):
    first, second = entered(f"student_id,n,v_A,v_B\ns01,7,{cell},58\ns02,8,60,61\n")
    assert "line 2, v_A" in told(first)
    assert why in told(first)
    assert "v_A" not in first.reading.figures["velocity_plan"].vectors
    assert vector(first, "v_B").length_mm == 58.0
    assert second.problems == ()


def test_all_faults_of_a_line_are_told(entered):
    (one,) = entered("student_id,n,position,v_A,v_A_deg\ns/1,x,2.5,-1,400\n")
    assert one.student_id is None
    assert len(one.problems) == 5


@pytest.mark.parametrize("student_id", ["", "..", "a b", "a/b", "ä"])
def test_a_student_id_that_is_none_is_refused(entered, student_id):
    (one,) = entered(f"student_id,v_A\n{student_id},60\n")
    assert one.student_id is None
    assert "refused" in told(one)


def test_a_student_twice_counts_once(entered):
    first, second = entered("student_id,v_A\ns01,60\ns01,61\n")
    assert vector(first, "v_A").length_mm == 60.0
    assert second.reading.figures == {}
    assert "on line 2 already" in told(second)


def test_a_student_may_have_several_positions(entered):
    press = names_of(load_assignment("press"))
    both = entered("student_id,position,v_A\ns01,1,50\ns01,2,50\n", names=press)
    assert [one.position for one in both] == [1, 2]
    assert all(one.problems == () for one in both)


@pytest.mark.parametrize("header", ["student_id,v_A", "v_A,student_id"])
def test_a_line_with_too_many_fields_is_not_used(entered, header):
    (one,) = entered(f"{header}\ns01,60,5\n")
    assert one.reading.figures == {}
    assert "3 fields" in told(one)


def test_short_and_blank_lines_are_understood(entered):
    (one,) = entered("student_id,v_A,v_B\n\ns01,60\n,,\n")
    assert vector(one, "v_A").length_mm == 60.0
    assert one.line == 3


def test_a_vector_that_the_plans_are_drawn_without_is_told(entered):
    press = names_of(load_assignment("press"))
    first, second = entered("student_id,v_CA,v_A\ns01,20,50\ns02,,50\n", names=press)
    assert "v_CA" in told(first)
    assert second.problems == ()


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"", "empty"),
        (b"\n\n", "empty"),
        (b'student_id,v_A\n"s01,60\n', "no CSV"),
        (b"student_id,v_A\n\xff\xfa\xe9,60\n", "not UTF-8"),
    ],
)
def test_a_file_that_is_none_is_refused(entered, content, why):
    with pytest.raises(InputFileError, match=why):
        entered(content)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(InputFileError, match="cannot be read"):
        read_measurements(tmp_path / "none.csv", NAMES)


def test_a_huge_file_is_refused(tmp_path):
    path = tmp_path / "huge.csv"
    with path.open("wb") as file:
        file.truncate(30_000_000)
    with pytest.raises(InputFileError, match="no measurements"):
        read_measurements(path, NAMES)


# JSON ---------------------------------------------------------------------------------------------

GOOD = {
    "student_id": "s07",
    "n": 7,
    "scales": {"kL": "1:5", "kv": 0.185},
    "segments_mm": {"v_A": 60.0, "v_B": 58},
    "directions_deg": {"v_A": 134.0},
    "values": {"v_D": 1.23, "omega_3": -4.0},
}


def test_a_students_file_is_read(entered):
    (one,) = entered(json.dumps(GOOD), "s07.json")
    assert (one.student_id, one.n, one.position, one.line) == ("s07", 7, None, None)
    assert one.scales == {"kL": "1:5", "kv": "0.185"}
    assert vector(one, "v_A").direction_deg == 134.0
    assert vector(one, "v_B").length_mm == 58.0
    assert one.values == {"v_D": 1.23, "omega_3": -4.0}


def test_a_students_file_need_not_name_its_student(entered):
    (one,) = entered('{"segments_mm": {"v_A": 60}}', "s07.json")
    assert one.student_id is None


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"segments_mm": {"v_A": -1}}, r"\$\.segments_mm\.v_A"),
        ({"segments_mm": {"v_A": 5000}}, r"\$\.segments_mm\.v_A.*2000"),
        ({"segments_mm": {"v_AA": 1}}, r"\$\.segments_mm\.v_AA.*did you mean"),
        ({"directions_deg": {"v_A": 400}}, r"\$\.directions_deg\.v_A"),
        ({"values": {"w_3": 1}}, r"\$\.values\.w_3"),
        ({"student_id": "../x"}, r"\$\.student_id"),
        ({"scales": {"kq": "1"}}, r"\$\.scales"),
        ({"n": 7.5}, r"\$\.n"),
        ({"lengths": {}}, r"\$\.lengths.*not known"),
    ],
)
def test_a_fault_is_told_with_its_path(entered, change, where):
    with pytest.raises(InputFileError, match=where):
        entered(json.dumps(GOOD | change), "s07.json")


@pytest.mark.parametrize("text", ["{", "[]", '{"segments_mm": {"v_A": NaN}}', "[" * 100_000])
def test_what_is_no_such_document_is_refused(entered, text):
    with pytest.raises(InputFileError):
        entered(text, "s07.json")


def test_a_vector_that_the_plans_are_drawn_without_is_told_in_json_too(entered):
    press = names_of(load_assignment("press"))
    (one,) = entered('{"segments_mm": {"v_CA": 60}}', "s07.json", press)
    assert "v_CA" in told(one)
