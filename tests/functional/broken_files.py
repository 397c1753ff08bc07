"""A course whose files are broken one at a time: what the author is told.

Each case changes good files as people do, runs a command, and says which file and which place in it the
message must name. `docs.make_faults` prints all messages as a page.
"""

import json
import os
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from typer.testing import CliRunner

from grader.cli.app import app
from tests.conveyor import MECHANISM
from tests.inline import without_workers

ASSIGNMENT = """\
schema_version = 1
id = "course"
mechanism = "course"
rubric = "course"
[title]
en = "Plans of the conveyor"
ro = "Planurile transportorului"
ru = "Планы конвейера"
[task]
en = "Draw the plans."
ro = "Desenați planurile."
ru = "Постройте планы."
[variant]
table = "course.csv"
[variant.values]
phi = "10*n + 280"
[scales]
kL = 0.0025
kv = 0.02
ka = 0.4
[[page]]
kind = "velocity"
figures = ["mechanism", "velocity_plan"]
[[page]]
kind = "acceleration"
figures = ["mechanism", "acceleration_plan"]
[[given]]
label = "O1A"
value = "a"
unit = "mm"
[[given]]
label = "O1O2"
value = "d"
unit = "mm"
[[given]]
label = "φ"
value = "phi"
unit = "°"
"""
RUBRIC = """\
schema_version = 1
id = "course"
[title]
en = "Conveyor"
ro = "Transportor"
ru = "Конвейер"
[tolerance]
length_mm = 1.0
direction_deg = 1.5
[[criterion]]
id = "v_B"
title = { en = "Velocity of B", ro = "Viteza punctului B", ru = "Скорость точки B" }
points = 2.0
vector = "v_B"
[[criterion]]
id = "a_B"
title = { en = "Acceleration of B", ro = "Accelerația punctului B", ru = "Ускорение точки B" }
points = 3.0
vector = "a_B"
"""
TABLE = "n,a [mm],d [mm]\n1,85,260\n2,90,250\n3,88,255\n"
ROSTER = "student_id,name,n\ns01,Ana,1\ns02,Ion,2\n"
MEASUREMENTS = "student_id,n,kL,kv,ka,v_B,v_B_deg\ns01,1,0.0025 m/mm,0.02 (m/s)/mm,0.4 (m/s^2)/mm,45.0,120\n"
DECISIONS = "student_id,position,criterion,verdict,points,comment,by,at,basis\ns01,,v_B,full,2,,A. B.,,\n"
IDS = "student_id,id\ns01,11\ns02,12\n"
WORKSHEET = (
    "Identifier,Full name,Email address,Grade,Maximum grade,Grade can be changed,Last modified (grade)\n"
    "Participant 1,Ana,a@x.ro,,5.00,Yes,-\nParticipant 2,Ion,b@x.ro,,5.00,Yes,-\n"
)
FILES = {
    "course.mechanism.toml": MECHANISM, "course.assignment.toml": ASSIGNMENT, "course.rubric.toml": RUBRIC,
    "course.csv": TABLE, "class/roster.csv": ROSTER, "class/measurements.csv": MEASUREMENTS,
    "class/decisions.csv": DECISIONS, "ids.csv": IDS, "worksheet.csv": WORKSHEET,
}  # fmt: skip

LINT = "lint course.assignment.toml"
GRADE = "grade class --assignment course.assignment.toml --roster class/roster.csv --out marks"
IDS_EXPORT = "export marks --to lti --ids ids.csv"
MOODLE_EXPORT = "export marks --to moodle --worksheet worksheet.csv --roster class/roster.csv"
M, A, R, T = "course.mechanism.toml", "course.assignment.toml", "course.rubric.toml", "course.csv"
ROSTER_FILE, MEASURED, DECIDED = "class/roster.csv", "class/measurements.csv", "class/decisions.csv"


@dataclass(frozen=True, slots=True)
class Case:
    """A change of one file, and the file and place that the message must name.

    Attributes
    ----------
    old, new : a part of the file's text and what stands there instead; of an empty `old` the whole text
    place : what must stand in the message beside the file's name: a path, a line, a column
    """

    title: str
    file: str
    old: str
    new: str
    place: str
    command: str = LINT

    def write(self, folder: Path) -> None:
        """The course with this change."""
        for name, text in FILES.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(self.broken(text) if name == self.file else text, encoding="utf-8")

    def broken(self, text: str) -> str:
        """The file's text with the change."""
        assert self.old in text
        return text.replace(self.old, self.new, 1) if self.old else self.new


def _of(file: str, command: str = LINT) -> Callable[[str, str, str, str], Case]:
    return lambda title, old, new, place: Case(title, file, old, new, place, command)


_m, _a, _r, _t = (_of(file) for file in (M, A, R, T))
_roster, _measured, _decided = (_of(file, GRADE) for file in (ROSTER_FILE, MEASURED, DECIDED))
_ids, _worksheet = _of("ids.csv", IDS_EXPORT), _of("worksheet.csv", MOODLE_EXPORT)

CASES = [
    # The mechanism.
    _m("no TOML", "[title]", "[title", "line 4"),
    _m("quote left open", 'en = "Conveyor"', 'en = "Conveyor', "line 5"),
    _m("decimal comma", "lengths = [210, 165]", "lengths = [210,5, 165]", "$.group[0].lengths"),
    _m("comma as decimal mark of one number", "length = 320", "length = 320,5", "line 29"),
    _m("unit in the value", "length = 320", 'length = "320 mm"', "$.group[1].length"),
    _m("unit in the value, without a space", "length = 320", 'length = "32cm"', "$.group[1].length"),
    _m("number in quotes with a degree sign", 'angle_deg = "phi"', 'angle_deg = "45°"', "$.crank.angle_deg"),
    _m("type in small letters", 'type = "RRR"', 'type = "rrr"', "$.group[0].type"),
    _m("type in Cyrillic letters", 'type = "RRP"', 'type = "RRР"', "$.group[1].type"),
    _m("unknown type", 'type = "RRR"', 'type = "dyad"', "$.group[0].type"),
    _m("no type", 'type = "RRR"\n', "", "$.group[0].type"),
    _m("[[crank]] for [crank]", "[crank]", "[[crank]]", "$.crank"),
    _m("[group] for [[group]]", '[[group]]\ntype = "RRP"', '[group]\ntype = "RRP"', "line 24"),
    _m("a single [group]", MECHANISM[MECHANISM.index("[[group]]") :], '[group]\ntype = "RRR"\n', "$.group"),
    _m("joint in Cyrillic", 'pins = ["A", "O2"]', 'pins = ["А", "O2"]', "$.group[0].pins[0]"),
    _m("new joint in Cyrillic", 'node = "B"', 'node = "В"', "$.group[0].node"),
    _m("Greek letter for a joint", 'node = "B"', 'node = "Β"', "$.group[0].node"),
    _m("pole of ground with zero for O", 'pins = ["A", "O2"]', 'pins = ["A", "02"]', "$.group[0].pins[1]"),
    _m("unknown pin", 'pins = ["A", "O2"]', 'pins = ["A", "O3"]', "$.group[0].pins[1]"),
    _m("joint in small letters", 'pin = "A"', 'pin = "a"', "$.crank.pin"),
    _m("joint called O", 'pin = "A"', 'pin = "O"', "$.crank.pin"),
    _m("joint placed twice", 'node = "C"', 'node = "B"', "$.group[1].node"),
    _m("link named twice", 'link = "4"', 'link = "3"', "$.group[1].link"),
    _m("no side", 'side = "left"\n', "", "$.group[0].side"),
    _m("side of another group", 'side = "left"', 'side = "ahead"', "$.group[0].side"),
    _m("side above", 'side = "left"', 'side = "above"', "$.group[0].side"),
    _m("misspelt key", 'angle_deg = "phi"', 'angle = "phi"', "$.crank.angle"),
    _m("key of another table", "rpm = 120", "rpm = 120\nlengths = [1, 2]", "$.crank.lengths"),
    _m("two speeds", "rpm = 120", "rpm = 120\nomega = 3", "$.crank"),
    _m("no speed", "rpm = 120\n", "", "$.crank"),
    _m("no driving link", MECHANISM[MECHANISM.index("[crank]") : MECHANISM.index("[[group]]")], "", "$"),
    _m("unknown unit", 'length_unit = "mm"', 'length_unit = "in"', "$.length_unit"),
    _m("no unit", 'length_unit = "mm"\n', "", "$.length_unit"),
    _m("metres in a millimetre file", "lengths = [210, 165]", "lengths = [0.21, 0.16]", ".group[0].lengths"),
    _m("millimetres in a metre file", 'length_unit = "mm"', 'length_unit = "m"', "$.length_unit"),
    _m("negative length", "length = 320", "length = -320", "$.group[1].length"),
    _m("length of nothing", "length = 320", "length = 0", "$.group[1].length"),
    _m("lengths too short to assemble", "lengths = [210, 165]", "lengths = [60, 65]", "$.group[0]"),
    _m("unknown name in a formula", 'O2 = ["d", 0]', 'O2 = ["dd", 0]', "$.ground.O2[0]"),
    _m("Cyrillic name in a formula", 'length = "a"', 'length = "а"', "$.crank.length"),
    _m("unknown function", 'angle_deg = "phi"', 'angle_deg = "arcsin(0.5)"', "$.crank.angle_deg"),
    _m("formula left open", 'angle_deg = "phi"', 'angle_deg = "2*(phi"', "$.crank.angle_deg"),
    _m("division by nothing", 'angle_deg = "phi"', 'angle_deg = "phi/(n-1)"', "$.crank.angle_deg"),
    _m("one length for two", "lengths = [210, 165]", "lengths = 210", "$.group[0].lengths"),
    _m("three coordinates", "O1 = [0, 0]", "O1 = [0, 0, 0]", "$.ground.O1"),
    _m("later version", "schema_version = 1", "schema_version = 2", "$.schema_version"),
    _m("no English title", 'en = "Conveyor"\n', "", "$.title.en"),
    _m("pin that is no ground pivot", 'pivot = "O1"', 'pivot = "O5"', "$.crank.pivot"),
    _m("guide of half a kind", ", angle_deg = 0 }", " }", "$.group[1].guide"),
    _m("empty file", "", "", "$"),
    Case("column missing in the table", M, "length = 320", 'length = "e"', "$.group[1].length"),
    # The assignment.
    _a("mechanism that is not there", 'mechanism = "course"', 'mechanism = "cource"', "$.mechanism"),
    _a("rubric that is not there", 'rubric = "course"', 'rubric = "rubrics"', "$.rubric"),
    _a("table that is not there", 'table = "course.csv"', 'table = "data.csv"', "data.csv"),
    _a("value called pi", 'phi = "10*n + 280"', 'phi = "10*n + 280"\npi = 3', "$.variant.values.pi"),
    _a("value called n", 'phi = "10*n + 280"', 'phi = "10*n + 280"\nn = 3', "$.variant.values.n"),
    _a("value called as a column", 'phi = "10*n + 280"', 'phi = "10*n + 280"\na = 3', "$.variant.values.a"),
    _a("value used before it is there", 'phi = "10*n + 280"', 'phi = "x + 1"\nx = 2', "$.variant.values.phi"),
    _a("Cyrillic name of a value", 'phi = "10*n + 280"', '"рhi" = "10*n + 280"', "$.variant.values"),
    _a("n and a table", "[variant]", "[variant]\nn = { from = 1, to = 3 }", "$.variant"),
    _a("range the wrong way", 'table = "course.csv"', "n = { from = 9, to = 3 }", "$.variant.n"),
    _a("scale as a ratio", "kL = 0.0025", 'kL = "1:2.5"', "$.scales.kL"),
    _a("scale of nothing", "kv = 0.02", "kv = 0", "$.scales.kv"),
    _a("unknown name in a scale", "kv = 0.02", 'kv = "omega2 * 2"', "$.scales.kv"),
    _a("scale in millimetres", "kL = 0.0025", "kL = 2.5", "$.scales.kL"),
    _a("unknown page kind", 'kind = "velocity"', 'kind = "velocities"', "$.page[0].kind"),
    _a("unknown figure", '"velocity_plan"]', '"velocity plan"]', "$.page[0].figures[1]"),
    _a("[page] for [[page]]", '[[page]]\nkind = "velocity"', '[page]\nkind = "velocity"', "line"),
    _a("given without a value", 'value = "d"\n', "", "$.given[1].value"),
    _a("given with an unknown name", 'value = "d"', 'value = "D"', "$.given[1].value"),
    _a("misspelt table", "[scales]", "[scale]", "$.scale"),
    _a("no title", ASSIGNMENT[ASSIGNMENT.index("[title]") : ASSIGNMENT.index("[task]")], "", "$.title"),
    _a("unknown tradition", 'rubric = "course"', 'rubric = "course"\ntradition = "q"', "$.tradition"),
    _a("no translation", 'ru = "Планы конвейера"\n', "", "$.title.ru"),
    # The table of variants.
    _t("letter for a digit", "2,90,250", "2,9O,250", "line 3, a"),
    _t("unit in a cell", "2,90,250", "2,90 mm,250", "line 3, a"),
    _t("cell left out", "2,90,250", "2,,250", "line 3, a"),
    _t("a row too short", "2,90,250", "2,90", "line 3"),
    _t("n twice", "2,90,250", "1,90,250", "line 3"),
    _t("no column n", "n,a [mm]", "no,a [mm]", "line 1"),
    _t("unknown unit", "a [mm]", "a [inch]", "line 1"),
    _t("column twice", "d [mm]", "a [mm]", "line 1"),
    _t("Cyrillic column", "a [mm]", "а [mm]", "line 1"),
    _t("reserved column", "d [mm]", "pi [mm]", "line 1"),
    _t("length of nothing", "2,90,250", "2,0,250", "row 3"),
    _t("decimal commas between commas", "2,90,250", "2,90,5,250", "line 3"),
    # The rubric.
    _r("unknown vector", 'vector = "v_B"', 'vector = "v_K"', "$.criterion[0].vector"),
    _r("Cyrillic vector", 'vector = "v_B"', 'vector = "v_В"', "$.criterion[0].vector"),
    _r("criterion twice", 'id = "a_B"', 'id = "v_B"', "$.criterion[1].id"),
    _r("points as text", "points = 2.0", 'points = "2"', "$.criterion[0].points"),
    _r("negative points", "points = 2.0", "points = -2.0", "$.criterion[0].points"),
    _r("two things in one criterion", 'vector = "v_B"', 'vector = "v_B"\nscale = "kv"', "$.criterion[0]"),
    _r("nothing to judge", 'vector = "v_B"\n', "", "$.criterion[0]"),
    _r("misspelt tolerance", "length_mm = 1.0", "lenght_mm = 1.0", "$.tolerance.lenght_mm"),
    _r("tolerance of nothing", "direction_deg = 1.5", "direction_deg = -1", "$.tolerance.direction_deg"),
    _r("no translation of a criterion", ', ru = "Скорость точки B"', "", "$.criterion[0].title.ru"),
    # The class.
    _roster("no student_id", "student_id,", "student,", "line 1"),
    _roster("student twice", "s02,Ion", "s01,Ion", "line 3"),
    _roster("space in a student_id", "s02,Ion", "s 02,Ion", "line 3"),
    _roster("Cyrillic letter in a student_id", "s02,Ion", "с02,Ion", "line 3"),
    _roster("n is no number", "Ion,2", "Ion,two", "line 3"),
    _roster("n of no variant", "Ion,2", "Ion,7", "s02"),
    _roster("misspelt column", "student_id,name,n", "student_id,nmae,n", "line 1"),
    _roster("semicolons in some lines", "s02,Ion,2", "s02;Ion;2", "line 3"),
    _measured("letter for a digit", "45.0", "45.O", "line 2"),
    _measured("unknown vector", "v_B,v_B_deg", "v_BB,v_B_deg", "v_BB"),
    _measured("direction beyond a turn", ",120", ",1200", "line 2"),
    _measured("scale without a unit", "0.02 (m/s)/mm", "0.02", "kv"),
    _decided("unknown verdict", "v_B,full", "v_B,right", "line 2"),
    _decided("unknown criterion", "s01,,v_B", "s01,,v_K", "line 2"),
    _decided("points beyond the maximum", "full,2", "full,9", "line 2"),
    # Tables of platforms.
    _ids("misspelt column", "student_id,id", "student_id,user", "line 1"),
    _ids("student twice", "s02,12", "s01,12", "line 3"),
    _worksheet("comma in a grade", "b@x.ro,,5.00", 'b@x.ro,"3,5",5.00', "row 3"),
    _worksheet("bare numbers", "Participant 2", "2", "row 3"),
    _worksheet("another maximum", "5.00,Yes,-\nParticipant 2", "100.00,Yes,-\nParticipant 2", "100"),
]  # fmt: skip

KINDS = {M: "mechanism", A: "assignment", R: "rubric"}
"""The names of the files in findings of `lint`."""
_FINDING = re.compile(r"(fault|warning|hint)\b.*")


@dataclass(frozen=True, slots=True)
class Told:
    """A command's answer to a case: its exit status, and the lines of its message."""

    case: Case
    status: int
    lines: tuple[str, ...]
    error: BaseException | None = None

    @property
    def line(self) -> str:
        """The line that names the place; empty where none does."""
        name = Path(self.case.file).name
        head = rf"(fault|warning|hint)\s+{KINDS.get(self.case.file, name)} "
        # Of a class that is graded the line names the student.
        is_named = self.case.command == GRADE or any(name in line for line in self.lines)
        known = [
            line for line in self.lines if self.case.place in line and (is_named or re.match(head, line))
        ]
        return known[0].strip() if known else ""


def _problems(results: dict[str, Any]) -> list[str]:
    """The problems in the results, each with its file."""
    reports = [results, *results["reports"], *results["unmatched"]]
    problems = [one for report in reports for one in report.get("problems", ())]
    return [f"{one['file'] or 'class'}: {one['message']}" for one in problems]


def told(cases: list[Case]) -> Iterator[Told]:
    """Run the command of each case, in a folder of its own."""
    with TemporaryDirectory() as name, chdir(name), without_workers():
        folder = Path(name).resolve()
        Case("", "", "", "", "").write(folder)
        CliRunner().invoke(app, GRADE.split())
        shutil.move(folder / "marks", folder / "graded")
        for case in cases:
            case.write(folder)
            shutil.rmtree(folder / "marks", ignore_errors=True)
            if case.command.startswith("export"):
                shutil.copytree(folder / "graded", folder / "marks")
            ran = CliRunner().invoke(app, case.command.split())
            text = ran.output.replace(f"{folder}{os.sep}", "").replace(f"{name}{os.sep}", "")
            lines = [line for line in text.splitlines() if line.strip()]
            found = [line for line in lines if _FINDING.match(line)]
            results = folder / "marks" / "results.json"
            if case.command == GRADE and results.exists():
                lines += _problems(json.loads(results.read_bytes()))
            error = None if isinstance(ran.exception, SystemExit) else ran.exception
            yield Told(case, ran.exit_code, tuple(found or lines), error)
