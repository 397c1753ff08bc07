"""Submissions are reported as they are: nobody whose file is there is missing, no source silently wins."""

import json

import pytest

from grader.files import samples_folder
from tests.inline import planmark

GOOD = json.loads((samples_folder() / "pump" / "s08.json").read_text(encoding="utf-8"))
N = GOOD["n"]


def of(student, **change):
    return GOOD | {"student_id": student} | change


def text(student, **change):
    return json.dumps(of(student, **change)).encode()


LONG = {**GOOD["segments_mm"], "v_B": GOOD["segments_mm"]["v_B"] + 5.0}
WITHOUT_ID = {key: value for key, value in GOOD.items() if key != "student_id"}
FILES = {
    "s01.json": text("s01"),
    "s02.json": text("s02")[:-5],
    "s03.json": b"\xff\xfa" + text("s03"),
    "s04.json": b"",
    "s05.json": b" " * 2_000_000,
    "s07.json": text("s08"),
    "s08.json": text("s08"),
    "s09.json": text("s09", directions_deg=GOOD["directions_deg"] | {"v_A": 720}),
    "s10.json": text("s10"),
    "s10_again.json": text("s10", segments_mm=LONG),
    "s11.json": text("s11"),
    "s12.json": text("s12").replace(b'"v_A":', b'"v_A": 1.5, "v_A":', 1),
    "s13.json": json.dumps(WITHOUT_ID).encode(),
    "s14.json": text("s14", lengths={}),
    "s15.json": text("s15"),
    "s15_again.json": text("s15"),
    "few.csv": b"student_id,v_A,v_A_deg\ns16,60,nan\ns17,60,5,58\nCON,1,1\n",
    "wrong.csv": b"student_id,size,colour\ns18,60,5\ns19,60,4\n",
}
ROSTER = "student_id,name,n,kv\n" + "".join(
    f"s{number:02d},Student {number},{N},{'0.2 (m/s)/mm' if number == 11 else ''}\n"
    for number in range(1, 21)
)
STATUS = {
    **dict.fromkeys(["s01", "s08", "s13", "s15"], "graded"),
    **dict.fromkeys(["s02", "s03", "s04", "s05", "s07", "s14", "s17", "s18", "s19"], "unreadable"),
    **dict.fromkeys(["s09", "s10", "s11", "s12", "s16"], "needs_review"),
    **dict.fromkeys(["s06", "s20"], "missing"),
}


def graded(folder, out, *options):
    return planmark("grade", folder, "--assignment", "pump", "--out", out, *options, cwd=out.parent)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("handed") / "in"
    folder.mkdir()
    for name, content in FILES.items():
        (folder / name).write_bytes(content)
    (folder / "roster.csv").write_text(ROSTER, encoding="utf-8")
    out = folder.parent / "out"
    run = graded(folder, out)
    assert run.returncode == 1
    return json.loads((out / "results.json").read_text(encoding="utf-8")), out


def report(results, student):
    return next(one for one in results[0]["reports"] if one["student_id"] == student)


def problems(results, student):
    return {one["code"]: one["message"] for one in report(results, student)["problems"]}


def waiting(results, student):
    return [one["id"] for one in report(results, student)["criteria"] if one["verdict"] == "review"]


@pytest.mark.parametrize(("student", "status"), STATUS.items())
def test_only_who_has_nothing_in_the_folder_is_missing(results, student, status):
    assert report(results, student)["status"] == status


@pytest.mark.parametrize("student", ["s02", "s03", "s04", "s05", "s14", "s18", "s19"])
def test_a_file_that_cannot_be_used_is_in_its_students_report_and_in_the_list(results, student):
    assert {"nothing_usable"} < problems(results, student).keys()
    assert "nothing_handed_in" not in problems(results, student)
    file = "wrong.csv" if student in {"s18", "s19"} else f"{student}.json"
    assert file in {one["file"] for one in results[0]["unmatched"]}
    page = (results[1] / student / "feedback.html").read_text(encoding="utf-8")
    assert "Nothing that was handed in can be used." in page


def test_a_file_that_claims_another_student_is_told_to_both_and_used_for_neither(results):
    for student in ("s07", "s08"):
        assert "the file's name: s07; the file's content: s08" in problems(results, student)["owner_disagree"]
    assert report(results, "s08")["score"] == report(results, "s01")["score"]
    assert [one["code"] for one in results[0]["unmatched"] if one["file"] == "s07.json"] == ["owner_disagree"]


@pytest.mark.parametrize(
    ("student", "criterion", "entry"),
    [
        ("s09", "v_A", "v_A_deg: '720'"),
        ("s10", "v_B", "v_B: 58 / 63"),
        ("s11", "kv", "'0.2 (m/s)/mm' / '0.267035 (m/s)/mm'"),
        ("s12", "v_A", "v_A: '1.5 / 60.0'"),
    ],
)
def test_what_was_refused_or_is_disputed_waits_alone(results, student, criterion, entry):
    assert waiting(results, student) == [criterion]
    (one,) = [one for one in report(results, student)["criteria"] if one["id"] == criterion]
    assert one["reasons"][0] == "entry_refused"
    assert entry in one["feedback"]


def test_two_files_that_agree_are_one_submission_and_are_told(results):
    assert "s15.json, s15_again.json" in problems(results, "s15")["measurements_twice"]
    assert report(results, "s15")["score"] == report(results, "s01")["score"]


def test_a_line_under_a_name_that_no_folder_can_have_is_nobodys(results):
    (told,) = [one for one in results[0]["unmatched"] if one["code"] == "measurements_unmatched"]
    assert "line 4, student_id: 'CON' is refused" in told["message"]
    assert not (results[1] / "CON").exists()


@pytest.mark.parametrize("student", ["results.json", "index.html", "summary.csv", "aux", "no/slash"])
def test_a_roster_with_such_a_name_is_refused_before_anything_is_written(tmp_path, student):
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "roster.csv").write_text(f"student_id,name,n\n{student},A,7\n", encoding="utf-8")
    run = graded(folder, tmp_path / "out", "--roster", folder / "roster.csv")
    assert run.returncode == 2
    assert "line 2, student_id" in run.stderr
    assert student in run.stderr
    assert not (tmp_path / "out").exists()


def test_without_a_roster_names_that_no_folder_can_have_are_nobodys(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "class.csv").write_text(
        f"student_id,n,v_A\ns1,{N},60\nS1,{N},61\nresults.json,{N},60\nindex.html,{N},60\n", encoding="utf-8"
    )
    (folder / "s2.json").write_bytes(text("s2")[:-3])
    run = graded(folder, tmp_path / "out")
    assert run.returncode == 1
    results = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert {one["student_id"]: one["status"] for one in results["reports"]} == {
        "s1": "graded",
        "s2": "unreadable",
    }
    assert len(results["unmatched"]) == 4
