"""Reports of two checkouts are compared field by field."""

import json

from tests.bench.frozen import compare, differences
from tests.bench.judging_handed_in import measured_line
from tests.bench.judging_students import StudentKey


def test_reports_differ_by_what_they_say_and_not_by_times_version_or_rounding():
    before = {"score": 1.0, "timing_ms": {"ink": 3}, "schema_version": 1, "criteria": [{"points": 2}]}
    same = {**before, "score": 1.0 + 1e-12, "timing_ms": {"ink": 4}, "schema_version": 2}
    assert not list(differences(before, same))
    other = {"score": None, "schema_version": 1, "criteria": [{"points": 2.5}], "status": "graded"}
    assert {path for path, _, _ in differences(before, other)} == {
        "$.score", "$.criteria[0].points", "$.status"
    }  # fmt: skip
    assert [path for path, _, _ in differences([1], [1, 2])] == ["$"]
    assert list(differences({"ok": True}, {"ok": 1}))


def test_a_report_that_only_one_checkout_writes_is_a_difference(tmp_path, capsys):
    for side, names in (("before", ("s1", "s2")), ("after", ("s1",))):
        for name in names:
            (tmp_path / side / name).mkdir(parents=True)
            (tmp_path / side / name / "report.json").write_text(json.dumps({"score": 1}), encoding="utf-8")
    assert compare(tmp_path / "before", tmp_path / "after") == (1, 2)
    assert "s2/report.json: only before" in capsys.readouterr().out


def test_a_student_is_entered_as_a_line_of_the_table():
    line = measured_line(StudentKey("engine", "careful", "right", 5), with_directions=True)
    assert line["v_A"] > 0.0
    assert "v_A_deg" in line
    assert "v_A_deg" not in measured_line(StudentKey("engine", "careful", "right", 5), with_directions=False)
