"""Measurement files: what is understood, and every fault told with its place."""

import json

import pytest

from grader.language import tongue
from grader.records import of_error
from grader.tables.measurements import MAX_BYTES, combined, names_of, read_measurements, students_in
from grader.tables.reader import TableError
from grader.texts.spoken import message
from reference.authored.assignment import load_assignment

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
    return " | ".join(message(problem) for problem in measurements.problems)


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


def test_points_and_vectors_of_the_sketch_have_columns_and_keys(entered):
    (first,) = entered("student_id,n,a_D_sketch,a_D_sketch_deg,J3,J3_deg,J4\ns01,7,17.3,180,254,142,abc\n")
    keyed = '{"segments_mm": {"a_D_sketch": 17.3, "J3": 254}, "directions_deg": {"J3": 142}}'
    (by_key,) = entered(keyed, "a.json")
    for one in (first, by_key):
        vectors = one.reading.figures["mechanism"].vectors
        assert vectors["a_D_sketch"].length_mm == 17.3
        assert (vectors["J3"].length_mm, vectors["J3"].direction_deg) == (254.0, 142.0)
    assert [gap.name for gap in first.reading.unread] == ["J4"]
    assert told(first) == "line 2, J4: 'abc' is no number"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_semicolons_come_with_decimal_commas(entered, encoding):
    text = "student_id;n;v_A;v_B\r\ns01;7,0;60,25;58.5\r\n"
    (one,) = entered(text.encode(encoding))
    assert one.n == 7
    assert vector(one, "v_A").length_mm == 60.25
    assert vector(one, "v_B").length_mm == 58.5


def test_a_column_that_is_not_known_is_told_and_loses_nothing_else(entered):
    first, second = entered("student_id,n,v_A,v_BAA,colour\ns01,7,60,58,red\ns02,8,61,,\n")
    assert vector(first, "v_A").length_mm == 60.0
    assert [problem.code for problem in first.problems] == ["measurement_columns"] * 2
    assert "v_BAA" in message(first.problems[0])
    assert "did you mean v_BA" in message(first.problems[0])
    assert "v_BA" in {gap.name for gap in first.reading.unread}
    assert first.is_usable
    assert not second.problems


def test_a_column_that_the_misspelt_one_may_mean_and_that_is_there_too_is_judged(entered):
    (one,) = entered("student_id,v_BA,v_BA1,v_AB\ns01,58,3,4\n")
    assert "v_BA" not in {gap.name for gap in one.reading.unread}


def test_a_file_without_any_known_column_is_refused(entered):
    with pytest.raises(TableError, match="no known column of measurements"):
        entered("student_id,colour\ns01,red\n")


def test_a_students_own_file_needs_no_student(tmp_path):
    (tmp_path / "mine.csv").write_text("v_A,v_B\n# mm,mm\n60,58\n", encoding="utf-8")
    (one,) = read_measurements(tmp_path / "mine.csv", NAMES, is_own=True)
    assert (one.student_id, one.line, one.is_usable) == (None, 3, True)
    assert vector(one, "v_B").length_mm == 58.0


@pytest.mark.parametrize(
    ("column", "cell", "number"),
    [
        ("v_A", "60.2 mm", 60.2), ("v_A", "6.02cm", 60.2),
        ("v_A_deg", "30°", 30.0), ("v_A_deg", "0.5 rad", 28.6479),
        ("v_A_value", "1.5 m/s", 1.5), ("v_A_value", "150 cm/s", 1.5), ("a_B_value", "3 м/с²", 3.0),
        ("omega_2_value", "20 rev/min cw", -2.0944), ("omega_2_value", "2.1 s⁻¹", 2.1),
    ],
)  # fmt: skip
def test_a_number_with_its_unit_or_another_of_its_kind_is_read(entered, column, cell, number):
    (one,) = entered(f"student_id,{column}\ns01,{cell}\n")
    assert not one.problems
    assert one.numbers[column] == pytest.approx(number, abs=1e-4)


@pytest.mark.parametrize("cell", ["12 m", "12 m/4 s", "2 3 m/s", "5 m/s^2", "3 N", "1.5 m/s/2", "5 rev m/s"])
def test_a_number_in_a_unit_of_another_kind_is_refused_with_the_unit_asked_for(entered, cell):
    (one,) = entered(f"student_id,v_A_value\ns01,{cell}\n")
    assert one.values == {}
    assert f"'{cell}' is no number in m/s" in message(one.problems[0])


@pytest.mark.parametrize(
    ("lang", "said"), [("ro", "rândul 2, v_A: „x” nu este un număr"), ("ru", "строка 2, v_A: «x»: не число")]
)
def test_faults_are_told_in_the_readers_language(entered, lang, said):
    (one,) = entered("student_id,v_A\ns01,x\n")
    (problem,) = one.problems
    assert (problem.code, problem.parameters) == (
        "measurement_fault",
        {"why": "no_number", "line": 2, "cell": "v_A", "text": "x"},
    )
    assert message(problem, tongue(lang)) == said


def test_a_file_that_is_refused_is_told_in_the_readers_language_with_all_its_faults(entered):
    with pytest.raises(TableError) as caught:
        entered("n,v_A,v_A\n1,2,3\n")
    told = caught.value.told(tongue("ro")).message
    assert told.startswith("class.csv:\n  rândul 1: lipsește coloana student_id")
    assert "coloana v_A apare de 2 ori" in told
    assert of_error(caught.value).parameters["more"] == 1


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
    assert ("refused" if student_id else "line 2, student_id: is empty") in told(one)


@pytest.mark.parametrize(
    ("column", "cell"), [("v_A", "6O"), ("v_A_deg", "720"), ("v_A_deg", "nan"), ("v_A_value", "1e400")]
)
def test_a_refused_value_is_carried_with_what_was_entered(entered, column, cell):
    (one,) = entered(f"student_id,{column},v_B\ns01,{cell},58\n")
    assert [(gap.name, ", ".join(gap.reason.parameters["entries"])) for gap in one.reading.unread] == [
        ("v_A", f"{column}: '{cell}'")
    ]
    assert one.numbers == {"v_B": 58.0}


@pytest.mark.parametrize("cell", ["9" * 120_000 + "x", "1." + "0" * 120_000 + "x"])
def test_a_cell_of_a_hundred_thousand_digits_is_told_in_a_line(entered, cell):
    (one,) = entered(f"student_id,n,v_A,kv\ns01,{cell},{cell},{cell}\n")
    assert len(one.problems) == 3
    assert len(told(one)) < 500
    assert [gap.name for gap in one.reading.unread] == ["v_A", "kv"]


def test_a_student_on_two_lines_is_read_twice_so_that_neither_line_is_lost(entered):
    first, second = entered("student_id,v_A\ns01,60\ns01,61\n")
    assert (first.numbers, second.numbers) == ({"v_A": 60.0}, {"v_A": 61.0})
    assert (first.place, second.place) == ("class.csv:2", "class.csv:3")


def test_no_more_faults_are_told_than_a_person_reads(entered):
    vectors = list(NAMES.vectors)[:30]
    (one,) = entered(f"student_id,{','.join(vectors)}\ns01{',x' * 30}\n")
    assert len(one.problems) == 21
    assert message(one.problems[-1]) == "... more faults: 10"
    assert len(one.reading.unread) == 30


def test_no_more_unknown_columns_are_told_than_a_person_reads(entered):
    header, cells = ",".join(f"v_A{number}x" for number in range(20_000)), ",1" * 20_000
    (one,) = entered(f"student_id,v_A,{header}\ns01,60{cells}\n")
    assert len(one.problems) == 20
    assert vector(one, "v_A").length_mm == 60.0


@pytest.mark.parametrize("line", ["s01,seven,,60", "s01,7,1.5,60", "s/1,7,,60"])
def test_a_line_that_is_of_no_known_student_or_variant_is_not_used(entered, line):
    (one,) = entered(f"student_id,n,position,v_A\n{line}\n")
    assert not one.is_usable


def test_a_student_may_have_several_positions(entered):
    press = names_of(load_assignment("press"))
    both = entered("student_id,position,v_A\ns01,1,50\ns01,2,50\n", names=press)
    assert [one.position for one in both] == [1, 2]
    assert all(one.problems == () for one in both)


@pytest.mark.parametrize("header", ["student_id,v_A", "v_A,student_id"])
def test_a_line_with_too_many_fields_is_not_used(entered, header):
    (one,) = entered(f"{header}\ns01,60,5\n")
    assert one.reading.figures == {}
    assert not one.is_usable
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


@pytest.mark.parametrize(
    ("change", "where", "entry"),
    [
        ({"segments_mm": {"v_A": -1, "v_B": 58}}, "$.segments_mm.v_A: '-1': a drawn length", "v_A: '-1'"),
        ({"segments_mm": {"v_A": 5000, "v_B": 58}}, "from 0 to 2000\u00a0mm", "v_A: '5000'"),
        ({"segments_mm": {"v_A": "60", "v_B": 58}}, "$.segments_mm.v_A: '60' is no number", "v_A: '60'"),
        ({"segments_mm": {"v_A": True, "v_B": 58}}, "is no number", "v_A: 'True'"),
        ({"segments_mm": {"v_A": [60], "v_B": 58}}, "is no number", "v_A: '[...]'"),
        ({"directions_deg": {"v_A": 720}}, "$.directions_deg.v_A: '720': a direction is", "v_A_deg: '720'"),
        (
            {"values": {"omega_3": float("nan")}},
            "$.values.omega_3: 'NaN' is no finite",
            "omega_3_value: 'NaN'",
        ),
        ({"values": {"v_D": float("inf")}}, "'Infinity' is no finite number", "v_D_value: 'Infinity'"),
        ({"scales": {"kL": "1:5", "kv": [1, 2]}}, "$.scales.kv: '[...]' is no number", "kv: '[...]'"),
    ],
)
def test_a_refused_value_of_a_students_file_costs_that_value_alone(entered, change, where, entry):
    (one,) = entered(json.dumps(GOOD | change), "s07.json")
    assert where in told(one)
    assert [", ".join(gap.reason.parameters["entries"]) for gap in one.reading.unread] == [entry]
    assert vector(one, "v_B").length_mm == 58.0
    assert one.scales["kL"] == "1:5"


@pytest.mark.parametrize("number", ["1e400", "9" * 5000])
def test_a_number_that_no_computer_number_can_be_is_refused_alone(entered, number):
    (one,) = entered(f'{{"segments_mm": {{"v_A": {number}, "v_B": 58}}}}', "s07.json")
    assert "is no finite number" in told(one)
    assert one.numbers == {"v_B": 58.0}


def test_a_misspelt_name_is_told_and_what_it_may_have_been_meant_for_is_not_judged(entered):
    (one,) = entered('{"segments_mm": {"v_BAA": 12, "v_A": 60}}', "s07.json")
    assert "$.segments_mm.v_BAA: is not known here; did you mean v_BA" in told(one)
    assert ("v_BA", "v_BAA: '12'") in [
        (gap.name, ", ".join(gap.reason.parameters["entries"])) for gap in one.reading.unread
    ]
    assert "v_A" not in {gap.name for gap in one.reading.unread}
    assert one.numbers == {"v_A": 60.0}


def test_a_key_that_is_there_twice_has_no_value(entered):
    (one,) = entered('{"segments_mm": {"v_A": 60, "v_B": 58, "v_A": 65}}', "s07.json")
    assert "$.segments_mm.v_A: '60 / 65' is there more than once" in told(one)
    assert one.numbers == {"v_B": 58.0}


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"student_id": "../x"}, r"\$\.student_id"),
        ({"student_id": "results.json"}, r"\$\.student_id.*a file of the results"),
        ({"n": 7.5}, r"\$\.n"),
        ({"n": "7"}, r"\$\.n"),
        ({"lengths": {}}, r"\$\.lengths.*not known"),
        ({"segments_mm": [60]}, r"\$\.segments_mm"),
        ({"scales": "1:5"}, r"\$\.scales"),
    ],
)
def test_a_fault_of_the_whole_file_is_told_with_its_path(entered, change, where):
    with pytest.raises(TableError, match=where):
        entered(json.dumps(GOOD | change), "s07.json")


@pytest.mark.parametrize(
    "text",
    ["{", "[]", '{"n": NaN}', "[" * 100_000, '{"n": 7, "n": 8}', '{"segments_mm": {}, "segments_mm": {}}'],
)
def test_what_is_no_such_document_is_refused(entered, text):
    with pytest.raises(TableError):
        entered(text, "s07.json")


def test_half_of_a_surrogate_pair_becomes_text_that_can_be_written(entered):
    (one,) = entered(r'{"scales": {"kv": "\ud800"}, "values": {"\ud800": 1}}', "s07.json")
    assert one.scales["kv"] == r"\ud800"
    assert told(one).encode()


def test_a_vector_that_the_plans_are_drawn_without_is_told_in_json_too(entered):
    press = names_of(load_assignment("press"))
    (one,) = entered('{"segments_mm": {"v_CA": 60}}', "s07.json", press)
    assert "v_CA" in told(one)


# Several sets -------------------------------------------------------------------------------------


def test_sets_that_agree_are_taken_together(entered):
    (first,) = entered("student_id,v_A,kv\ns01,60,1:5\n", "a.csv")
    (second,) = entered("student_id,v_A,v_B_deg,v_B,omega_3_value\ns01,60,12,58,-4\n", "b.csv")
    both = combined([first, second])
    assert both.numbers == {"v_A": 60.0, "v_B": 58.0, "v_B_deg": 12.0, "omega_3_value": -4.0}
    assert both.reading.unread == ()
    assert [problem.code for problem in both.problems] == ["measurements_twice"]
    assert "a.csv:2, b.csv:2" in told(both)
    assert both.further_scales == (second.scales,)


def test_of_a_value_in_which_two_sets_differ_neither_counts(entered):
    (first,) = entered("student_id,v_A,v_A_deg\ns01,60,10\n", "a.csv")
    (second,) = entered("student_id,v_A,v_A_deg\ns01,65,10\n", "b.csv")
    both = combined([first, second])
    assert both.numbers == {"v_A_deg": 10.0}
    assert [(gap.name, ", ".join(gap.reason.parameters["entries"])) for gap in both.reading.unread] == [
        ("v_A", "v_A: 60 / 65")
    ]
    assert "v_A: 60 (a.csv:2), 65 (b.csv:2)" in told(both)


def test_what_was_refused_in_one_set_stays_refused(entered):
    (first,) = entered("student_id,v_A\ns01,x\n", "a.csv")
    (second,) = entered("student_id,v_A\ns01,65\n", "b.csv")
    assert [gap.name for gap in combined([first, second]).reading.unread] == ["v_A"]


# Files that cannot be used ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("x.json", b'{"student_id": "s07", "n": 7'),
        ("x.json", b'\xff{"student_id": "s07"}'),
        ("x.csv", b"v_A,student_id,v_A\n60,s07,61\n"),
        ("x.csv", "v_A,student_id,v_A\n60,s07,61\n".encode("utf-16")),
        ("x.csv", b'student_id,v_A\n"s07",\xe9\nresults.json,5\n'),
        ("x.csv", b"student_id,v_A\ns07,1\n" + b" " * MAX_BYTES),
    ],
)
def test_a_file_that_cannot_be_used_still_names_its_students(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(TableError):
        read_measurements(tmp_path / name, NAMES)
    assert students_in(tmp_path / name) == ("s07",)


def test_a_file_that_is_not_there_names_nobody(tmp_path):
    assert students_in(tmp_path / "none.csv") == ()


# Senses -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("cell", "value", "sense"),
    [
        ("2.09 cw", -2.09, -1.0),
        ("2.09 CCW", 2.09, 1.0),
        ('"2,09 по часовой стрелке"', -2.09, -1.0),
        ('"2,09 против ч. с."', 2.09, 1.0),
        ("2.09 sens orar", -2.09, -1.0),
        ("2.09 în sens trigonometric", 2.09, 1.0),
        ("2.09 counter-clockwise", 2.09, 1.0),
        ("2.09 ↻", -2.09, -1.0),
        ("↺ 2.09", 2.09, 1.0),
        ("-2.09 cw", -2.09, -1.0),
        ("+2.09", 2.09, 1.0),
        ("2.09", 2.09, None),
        ("-2.09", -2.09, None),
    ],
)
def test_an_angular_quantity_is_a_magnitude_with_its_sense_or_a_signed_value(entered, cell, value, sense):
    mark = ";" if "," in cell else ","
    (one,) = entered(f"student_id{mark}omega_2_value\ns01{mark}{cell}\n")
    assert one.values == {"omega_2": value} | ({} if sense is None else {"omega_2_sense": sense})
    assert one.problems == ()
    (other,) = entered(json.dumps({"student_id": "s01", "values": {"omega_2": cell.strip('"')}}), "s01.json")
    assert other.values == one.values


def test_a_sense_may_stand_in_a_column_of_its_own(entered):
    header = "student_id,omega_2_value,omega_2_sense,omega_3_sense\n"
    first, second, third = entered(header + "s01,2.09,cw,\ns02,2.09,,ccw\ns03,-2.09,,\n")
    assert first.values == {"omega_2": -2.09, "omega_2_sense": -1.0}
    assert second.values == {"omega_2": 2.09, "omega_2_sense": 0.0, "omega_3_sense": 1.0}
    assert third.values == {"omega_2": -2.09, "omega_2_sense": 0.0}
    values = {"omega_2": 2.09, "omega_2_sense": "по часовой"}
    (one,) = entered(json.dumps({"student_id": "s01", "values": values}), "s01.json")
    assert one.values == first.values
    assert combined([one, first]).values == first.values


@pytest.mark.parametrize("cells", ["2.09 cw,ccw", "-2.09,ccw", "2.09 cw ccw,", "2.09 orarx,", "2.09,left"])
def test_senses_that_contradict_each_other_or_are_none_are_refused(entered, cells):
    (one,) = entered(f"student_id,omega_2_value,omega_2_sense\ns01,{cells}\n")
    assert "omega_2" not in one.values
    assert [gap.name for gap in one.reading.unread] == ["omega_2"]
    assert "omega_2_value" in told(one)


def test_a_sense_that_is_none_is_told_in_its_own_column(entered):
    (one,) = entered("student_id,omega_2_value,omega_2_sense\ns01,,sideways\n")
    assert [gap.name for gap in one.reading.unread] == ["omega_2"]
    assert told(one) == "line 2, omega_2_sense: 'sideways' is no sense; write cw or ccw"
