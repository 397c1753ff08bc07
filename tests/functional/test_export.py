"""``planmark export`` as an instructor runs it: every command of the documentation, and wrong ones."""

import json
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
import zipfile
from pathlib import Path

import jsonschema
import pytest
import typer.main
from typer.testing import CliRunner

from grader.cli.commands import app
from grader.cli.exporting import schema
from grader.lms.export import TARGETS
from tests.inline import without_workers

ROOT = Path(__file__).parents[2]
RESULTS = Path(__file__).parent / "results.json"
DOCUMENT = (ROOT / "docs" / "exports.md").read_text(encoding="utf-8")
COMMANDS = re.findall(r"(?m)^    planmark (export .*)$", DOCUMENT)
SCHEMAS = {
    "export-moodle-rubric.json": "moodle-rubric",
    "export-moodle-marks.json": "moodle-marks",
    "export-lti.json": "lti",
}


def results():
    return json.loads(RESULTS.read_bytes())


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A folder with all the files that the documentation names; s08 is graded, s02 waits, s10 is missing."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "marks" / "s08").mkdir(parents=True)
    shutil.copy(RESULTS, tmp_path / "marks" / "results.json")
    (one,) = [report for report in results()["reports"] if report["student_id"] == "s08"]
    (tmp_path / "marks" / "s08" / "report.json").write_text(json.dumps(one))
    (tmp_path / "marks" / "s08" / "feedback.html").write_text("<p>page</p>")
    files = {
        "roster.csv": "student_id,name,email\ns02,B,b@x.ro\ns08,A,a@x.ro\ns10,C,c@x.ro\n",
        "ids.csv": "student_id,id,participant\ns02,102,2\ns08,108,8\n",
        "Grades-Pump.csv": "Identifier,Full name,Email address,Grade,Maximum grade,Last modified (grade)\n"
        "Participant 8,A,a@x.ro,,40.00,-\nParticipant 2,B,b@x.ro,,40.00,-\n",
        "export.csv": "Student,ID,SIS User ID,SIS Login ID,Section,Pump (12345)\n"
        "    Points Possible,,,,,40\nA,108,s08,,1,\nB,102,s02,,1,5\n",
        "brightspace.csv": "OrgDefinedId,Username,Pump Points Grade <Numeric MaxPoints:40>,"
        "End-of-Line Indicator\n#s08,#a,,#\n#s02,#b,3,#\n",
        "blackboard.xls": '"Last Name"\t"Username"\t"Pump [Total Pts: 40 Score] |7"\n"A"\t"s08"\t""\n',
        "status.csv": "update,usr_id,login,status,mark,comment\n0,8,s08,passed,,\n",
        "rubric.json": json.dumps({"id": 1, "data": criteria("description", "points", "_")}),
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    definitions(tmp_path, with_guide=False)
    api_answers(tmp_path)
    return tmp_path


def api_answers(folder):
    """Write the answers of Graph for the rubric, and of Graph, Classroom and Open edX for the submissions."""
    qualities = [
        {"qualityId": one["id"], "description": {"content": one["description"]}}
        for one in criteria("description", "points", "q")
    ]
    levels = [{"levelId": f"l{share}", "grading": {"maxPoints": share}} for share in (100, 50, 0)]
    rubric = {"id": "r", "qualities": qualities, "levels": levels}
    kinds = ("Rubric", "Points", "Feedback")
    outcomes = [{"@odata.type": f"#microsoft.graph.education{kind}Outcome", "id": kind} for kind in kinds]
    submissions = {"value": [{"id": "u-8", "recipient": {"userId": "108"}, "outcomes": outcomes}]}
    answers = {
        "graph-rubric.json": rubric,
        "graph-submissions.json": submissions,
        "submissions.json": {"studentSubmissions": [{"id": "u-8", "userId": "108"}]},
    }
    for name, answer in answers.items():
        (folder / name).write_text(json.dumps(answer), encoding="utf-8")
    with zipfile.ZipFile(folder / "multi_feedback.zip", "w") as archive:
        archive.writestr("multi_feedback_Pump_3/A_A_s08_8/", b"")


def criteria(name, points, before):
    (one,) = [report for report in results()["reports"] if report["student_id"] == "s08"]
    return [
        {"id": f"{before}{at}" if before else at, name: criterion["id"], points: criterion["max_points"]}
        for at, criterion in enumerate(one["criteria"], start=1)
    ]


def definitions(folder, *, with_guide):
    guide = {"method": "guide", "guide": {"guide_criteria": criteria("shortname", "maxscore", "")}}
    area = {"cmid": 3, "contextid": 5, "definitions": [guide] if with_guide else []}
    (folder / "definitions.json").write_text(json.dumps({"areas": [area]}), encoding="utf-8")


def planmark(command):
    return CliRunner().invoke(app, shlex.split(command))


def test_the_documentation_shows_every_platform_and_thing():
    shown = {tuple(re.findall(r"--(?:to|what) (\S+)", command)) for command in COMMANDS}
    assert {to for to, *_ in shown} >= set(TARGETS) - {"csv", "json"}
    assert {("moodle", what) for what in ("feedback", "rubric", "marks")} <= shown
    assert ("canvas", "rubric") in shown


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_of_the_documentation_writes_its_file(desk, command):
    definitions(desk, with_guide="--what marks" in command)
    ran = planmark(command)
    assert ran.exit_code == (0 if "--what rubric" in command else 1), ran.output
    (written,) = [path for path in (desk / "marks").iterdir() if path.name.startswith("export-")]
    assert f"written to {written.relative_to(desk)}" in ran.output
    if "--what rubric" not in command:
        is_first = "ms-education" in command and "--submissions" not in command
        assert ("0 students" if is_first else "1 student") + " written" in ran.output
        assert "s02: withheld: needs review" in ran.output
        assert "s10: withheld: nothing handed in" in ran.output
    if written.name in SCHEMAS:
        jsonschema.validate(json.loads(written.read_bytes()), schema(SCHEMAS[written.name]))


@pytest.fixture
def graded(tmp_path, monkeypatch):
    """A class graded into the folder `marks` of the documentation."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in").mkdir()
    for name in ("s08.json", "roster.csv"):
        shutil.copy(ROOT / "samples" / "pump" / name, tmp_path / "in")
    with without_workers():
        assert planmark("grade in --assignment pump --out marks").exit_code == 1
    return tmp_path / "marks"


BOTH = ("rubric.json", "assessments.json")


def test_the_json_that_grading_wrote_is_written_again_and_elsewhere_from_the_results_alone(graded):
    first = {name: (graded / name).read_bytes() for name in BOTH}
    for name in BOTH:
        (graded / name).write_text("{}")
    for to in ("", " --file marks/both.zip", " --file elsewhere"):
        ran = planmark(f"export marks --to json{to}")
        assert ran.exit_code == 0, ran.output
    assert "written to elsewhere" in ran.output
    assert "next: open elsewhere" in ran.output
    assert {name: (graded / name).read_bytes() for name in BOTH} == first
    assert {name: (graded.parent / "elsewhere" / name).read_bytes() for name in BOTH} == first
    with zipfile.ZipFile(graded / "both.zip") as archive:
        assert {name: archive.read(name) for name in archive.namelist()} == first
    assert "already exists" in planmark("export marks --to json --file elsewhere").output


def test_the_example_of_the_documentation_reads_both(graded):
    (example,) = re.findall(r"(?ms)^    import json$\n\n    rubric = .*?row\[\"comment\"\]\)$", DOCUMENT)
    call = [sys.executable, "-X", "utf8", "-c", textwrap.dedent(example)]
    ran = subprocess.run(call, capture_output=True, check=True)  # noqa: S603 - our own document
    lines = ran.stdout.decode().splitlines()
    results = json.loads((graded / "results.json").read_bytes())
    assert len(lines) == sum(1 + len(report["criteria"]) for report in results["reports"])
    s08 = next(place for place, line in enumerate(lines) if line.startswith("s08 None graded "))
    assert lines[s08 + 1] == "  Scara lungimilor 1.0 right Right."


def test_every_option_is_documented():
    parameters = typer.main.get_command(app).commands["export"].params
    options = {option for parameter in parameters for option in parameter.opts if option.startswith("--")}
    of_all_commands = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")
    assert options <= set(re.findall(r"--[a-z-]+", DOCUMENT + of_all_commands))


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("export marks --to sakai", "'sakai' is no export target"),
        ("export marks --to json", "is of an earlier version, which kept no rubric; grade again"),
        ("export marks --to json --file both.json", "kept no rubric"),
        ("export marks --to moodle --what results", "moodle is given no 'results'"),
        ("export marks --to canvas --what marks", "known are grades, rubric (or --to canvas-api)"),
        ("export marks --to canvas-api", "canvas-api needs --course-id, --assignment-id"),
        ("export marks --to canvas-api --course-id x --assignment-id 1", "'x' is not a number"),
        ("export marks --to openedx --submissions rubric.json", "no submissions are in this answer"),
        ("export marks --to openedx --submissions none.json", "none.json: cannot be read"),
        ("export marks --to blackboard", "Blackboard takes only its own file"),
        ("export marks --to ilias --what feedback", "ILIAS's archive is needed"),
        ("export marks --to brightspace --gradebook blackboard.xls", "it is a file of Blackboard"),
        ("export nowhere --to moodle", "run planmark grade first"),
        ("export marks --to moodle --worksheet none.csv", "none.csv: cannot be read"),
        ("export marks --to canvas --worksheet Grades-Pump.csv", "--worksheet is Moodle's"),
        ("export marks --to moodle --gradebook export.csv", "--gradebook has no meaning for moodle"),
        ("export marks --to moodle --worksheet export.csv", "column Identifier is missing"),
        (
            "export marks --to canvas --gradebook Grades-Pump.csv",
            "no gradebook as Canvas / Brightspace",
        ),
        ("export marks --to canvas --gradebook rubric.json", "no gradebook as Canvas / Brightspace"),
        ("export marks --to moodle --identity phone", "not by 'phone'"),
        ("export marks --to moodle --identity email", "has no email; the roster gives"),
        ("export marks --to moodle --maximum 100", "ask for rescaling"),
        ("export marks --to moodle --maximum -1 --rescale", "a positive number"),
        ("export marks --to lti --ids roster.csv", "is not known; remove it"),
        ("export marks --to lti --ids none.csv", "none.csv: there is no such file"),
        ("export marks --to lti --lang xx", "xx"),
        ("export marks --to lti --identity id", "--identity has no meaning for lti grades"),
        ("export marks --to moodle --combine best", "sum or mean"),
        ("export marks --to moodle --position 3", "no report"),
        ("export marks --to moodle --what feedback", "--worksheet"),
        ("export marks --to moodle --what rubric", "--cmid, --context-id"),
        ("export marks --to moodle --what marks", "--assignment-id"),
        (
            "export marks --to canvas-api --course-id 1 --assignment-id 2 --criteria definitions.json",
            "no criteria are in this answer",
        ),
        (
            "export marks --to canvas-api --course-id 1 --assignment-id 2 --criteria Grades-Pump.csv",
            "the columns are criterion, id",
        ),
        ("export marks --to gradescope --visibility shown", "is no visibility"),
        ("export marks --to moodle --file Grades-Pump.csv/x", "cannot be written"),
        ("export marks --to lti --file marks/results.json", "is read for this export"),
        ("export marks --to lti --ids ids.csv --file ids.csv", "is read for this export"),
        (
            "export marks --to canvas --item Pump --gradebook export.csv --file ./export.csv",
            "is read for this export",
        ),
    ],
)
def test_a_wrong_call_is_told_in_words_and_nothing_is_written(desk, command, message):
    before = {path: path.stat().st_mtime_ns for path in desk.rglob("*")}
    ran = planmark(command)
    assert ran.exit_code in {2, 5}, ran.output
    assert message in " ".join(ran.output.split())
    assert ran.exception is None or isinstance(ran.exception, SystemExit)
    assert {path: path.stat().st_mtime_ns for path in desk.rglob("*")} == before


def test_a_second_export_after_the_review_fills_in_the_rest(desk):
    document = results()
    command = "export marks --to moodle --worksheet Grades-Pump.csv --roster roster.csv"
    assert planmark(command).exit_code == 1
    first = (desk / "marks" / "export-moodle.csv").read_text(encoding="utf-8")
    for report in document["reports"]:
        if report["student_id"] == "s02":
            report.update(status="graded", score=30.0, score_range=[30.0, 30.0])
    document["reports"] = [report for report in document["reports"] if report["student_id"] != "s10"]
    (desk / "marks" / "results.json").write_text(json.dumps(document), encoding="utf-8")
    assert planmark(command).exit_code == 0
    second = (desk / "marks" / "export-moodle.csv").read_text(encoding="utf-8")
    assert second == first + "Participant 2,B,b@x.ro,30,40.00,-\n"
