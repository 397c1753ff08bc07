"""Gradebooks of Canvas, Brightspace, Blackboard and ILIAS: filled in, or made anew.

Only the columns that say who a row is, and the one that is asked for, are written: an import changes every
column that it finds, and others may have been graded since the download.

Canvas finds columns by their places: Student, ID, SIS User ID, SIS Login ID, Section, then assignments as
`title (number)`; below the header are the points possible, which become the assignment's. It reads `1,234`
as 1.234, and a blank takes a grade back: only the cells of students with a grade change, and a new file has
no other students.

Brightspace (community.d2l.com, article 3538, Importing grades): OrgDefinedId or Username or both, the item
as `title Points Grade`, in a download with `<Numeric MaxPoints:10 ...>`, and a last column of `#`. It caps a
grade above the maximum without a word.

Blackboard (its help on working offline with grade data): columns as `title [Total Pts: 10 Score] |number`,
with tabs in UTF-16 or with commas in UTF-8. A column without its number becomes a text column of no points.

ILIAS: the status file of an exercise (class ilExAssignmentStatusFile), whose rows count where `update` is 1;
its columns are read by their places, so all stay.
"""

import re
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from grader.files import is_formula
from grader.lms.grades import Delivery, Grade, Options, Person, ready
from grader.lms.marks import plain_comment
from grader.lms.moodle import pages_in
from grader.lms.table import (
    Evidence,
    Form,
    bytes_of,
    csv_text,
    fill_in,
    match_class,
    number,
    parse,
)
from grader.records import Reason
from grader.texts.spoken import failure
from reference.errors import CallError, InputFileError

HEADER = ("Student", "ID", "SIS User ID", "SIS Login ID", "Section")
_ABOUT = (*HEADER, "Integration ID", "Root Account", "LastName", "FirstName")
_NUMBERED = re.compile(r"(?P<title>.*\S)\s*\((?P<id>\d+)\)\s*", re.DOTALL)
_POINTS = "Points Possible"
_MANUAL = re.compile(r"\s*(Muted|Manual Posting.*)?\s*", re.IGNORECASE)
_MANGLED = re.compile(r"-?[0-9.,]*[.,][0-9.,]*%?")
"""Texts that Canvas takes for numbers and writes anew, in any column."""
_END = "End-of-Line Indicator"
_NO_TITLE = re.compile(r'[/"*<>+=|,%]')
"""Characters that the name of a grade item in Brightspace cannot have."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """A platform's gradebook as it is downloaded.

    Attributes
    ----------
    required : columns by which the file is known; of alternatives one, after `|`
    who : what each column says of a student: `id`, `student`, `login`, `email`
    kept : columns that are written too
    item : a gradebook's column of grades; its groups are `title`, `id` and `maximum`
    is_whole : whether all columns are written
    has_points : whether the maxima stand in a row below the header
    """

    platform: str
    required: tuple[str, ...]
    who: Mapping[str, str]
    item: re.Pattern[str]
    kept: tuple[str, ...] = ()
    is_whole: bool = False
    has_points: bool = False


LAYOUTS = {
    "canvas": Layout(
        platform="Canvas", required=("ID", "Section", "Student|LastName"), kept=_ABOUT,
        who={"ID": "ID", "SIS User ID": "student_id", "SIS Login ID": "login"},
        item=_NUMBERED, has_points=True,
    ),
    "brightspace": Layout(
        platform="Brightspace", required=("OrgDefinedId|Username", _END), kept=(_END,),
        who={"OrgDefinedId": "student_id", "Username": "login", "Email": "email"},
        item=re.compile(r"(?P<title>.+) Points Grade(?P<id>)(\s*<.*?MaxPoints:(?P<maximum>[\d.,]+).*>)?"),
    ),
    "ilias": Layout(
        platform="ILIAS", is_whole=True,
        required=("update", "usr_id", "login", "status", "mark", "comment"),
        who={"usr_id": "ID", "login": "login"}, item=re.compile("(?P<title>mark)(?P<id>)(?P<maximum>)"),
    ),
    "blackboard": Layout(
        platform="Blackboard", required=("Username", "Last Name"),
        kept=("Last Name", "First Name"), who={"Student ID": "student_id", "Username": "login"},
        # Of text columns, and of those that Blackboard computes from others, the kind is another.
        item=re.compile(r"(?P<title>.*\S)\s*\[[^\]\d]*(?P<maximum>[\d.,]+)(?: Score)?\]\s*\|(?P<id>\d+)"),
    ),
}  # fmt: skip
"""By platform, in the order in which a file is tried: the plainest last."""

_NAMES = {
    "Student": "name", "LastName": "last", "Last Name": "last", "lastname": "last",
    "FirstName": "first", "First Name": "first", "firstname": "first",
}  # fmt: skip
"""Columns of names, by their headings."""


# A new gradebook ----------------------------------------------------------------------------------


def gradebook(grades: Sequence[Grade], options: Options) -> Delivery:
    """A gradebook file made anew, with those who have a grade.

    Raises CallError with every student whom the platform would not find, and where it takes no new file.
    """
    if options.to == "brightspace":
        return _new_for_brightspace(ready(grades), options)
    if options.to != "canvas":
        raise failure(CallError, "gradebook_needed", platform=LAYOUTS[options.to].platform)
    item = options.item.strip() or grades[0].assignment
    faults = list(_faults(ready(grades)))
    if is_formula(item) or item in _ABOUT:
        faults.append(Reason("title", {"text": item}))
    if faults:
        raise failure(CallError, "gradebook", faults=faults)
    table = [["    " + _POINTS, "", "", "", "", number(options.maximum or grades[0].max_score)]]
    for grade in ready(grades):
        person = grade.person
        score = grade.out_of(options.maximum, rescale=options.rescale)
        name = person.name or grade.student_id
        table.append([name, person.platform_id, grade.student_id, person.username, "", number(score)])
    most = options.maximum or grades[0].max_score
    notes = [Reason("points_become", {"platform": "Canvas", "most_points": most})]
    notes += [] if _NUMBERED.fullmatch(item) else [Reason("new_assignment", {"text": item})]
    return Delivery(csv_text([*HEADER, item], table), notes=tuple(notes))


def _new_for_brightspace(grades: Sequence[Grade], options: Options) -> Delivery:
    """Users by the student_id as OrgDefinedId and by the username, each after a `#` as in a download."""
    item = options.item.strip() or (grades[0].assignment if grades else "planmark")
    if found := _NO_TITLE.search(item):
        raise failure(CallError, "item", "item_sign", item=item, sign=found[0])
    most = options.maximum or (grades[0].max_score if grades else 1.0)
    header = ("OrgDefinedId", "Username", f"{item} Points Grade <Numeric MaxPoints:{number(most)}>", _END)
    rows = [
        (
            f"#{grade.student_id}",
            f"#{grade.person.username}" if grade.person.username else "",
            number(grade.out_of(options.maximum, rescale=options.rescale)),
            "#",
        )
        for grade in grades
    ]
    notes = Reason("org_defined_id"), Reason("item_cut", {"text": item, "most_points": most})
    return Delivery(csv_text(header, rows), notes=notes)


def _faults(grades: Sequence[Grade]) -> Iterator[Reason]:
    owner: dict[str, str] = {}
    for grade in grades:
        person, who = grade.person, {"cell": grade.student_id, "platform": "Canvas"}
        user = {**who, "text": person.platform_id, "column": "ID"}
        if _MANGLED.fullmatch(grade.student_id) and not person.platform_id:
            yield Reason("taken_for_number", who)
        if person.platform_id and not re.fullmatch(r"[1-9][0-9]*", person.platform_id):
            yield Reason("no_user", user)
        if _POINTS in person.name:
            yield Reason("taken_for_points", {**who, "text": person.name})
        for text in (person.name, person.username):
            if is_formula(text):
                yield Reason("formula", {**who, "text": text})
        if person.platform_id and owner.setdefault(person.platform_id, grade.student_id) != grade.student_id:
            yield Reason("same_user", {**user, "other": owner[person.platform_id]})


# The teacher's own gradebook ----------------------------------------------------------------------


@dataclass(slots=True)
class Gradebook(Form):
    """A downloaded gradebook."""

    @classmethod
    def opened(cls, data: bytes, file: str, item: str) -> Self:
        """A gradebook as its platform exports it, and the column of an assignment in it."""
        table = parse(data, file, delimiter="\t" if b"\t" in data.partition(b"\n")[0] else None)
        header = [cell.strip() for cell in table.header()]
        layout = _layout(header, file)
        faults = table.ragged()
        points = next((row for row in range(1, min(len(table.rows), 4)) if _POINTS in table.value(row, 0)), 0)
        if layout.has_points and not points:
            faults.append(Reason("points_row", {"text": _POINTS}))
        if faults:
            raise _refused(file, layout.platform, *faults)
        about = {kind: header.index(name) for name, kind in layout.who.items() if name in header}
        others = [header.index(name) for name in layout.kept if name in header]
        first = max(others) + 1 if layout.has_points else 0
        assignment = _assignment(header, first, layout, item.strip(), file)
        match = layout.item.fullmatch(header[assignment])
        stated = table.value(points, assignment).strip() if points else match and match["maximum"]
        possible = cls.amount(stated or "")
        if stated and not possible:
            known = {"table_row": points + 1, "item": header[assignment], "text": stated}
            raise _refused(file, layout.platform, Reason("points_possible", known))
        columns = {**about, "grade": assignment}
        if layout.is_whole:
            columns |= {"update": header.index("update"), "feedback": header.index("comment")}
        else:
            table.kept = sorted({*about.values(), *others, assignment})
        columns |= {kind: header.index(name) for name, kind in _NAMES.items() if name in header}
        notes = [Reason("tabs")] if table.delimiter == "\t" else []
        return cls(table, columns, points, possible, notes, layout.platform)

    @staticmethod
    def amount(text: str) -> float | None:
        """A number as Canvas reads it: the last comma or dot is the decimal mark, the others group."""
        if not re.fullmatch(r"[0-9.,]*[0-9]", text):
            return None
        *whole, last = re.split("[.,]", text)
        return float("".join(whole) + "." + last) if whole else float(last)

    def why_fixed(self, row: int) -> Reason | None:
        """Return what the platform says where it wants no grade; None where it wants one."""
        grade = self.value(row, "grade")
        is_out = grade.casefold() in {"ex", "n/a", "exempt"}
        return Reason("grade_excused", {"platform": self.platform, "text": grade}) if is_out else None

    def identity(self, row: int) -> Mapping[str, str]:
        """The platform's numbers of the student, and the name.

        Brightspace puts a `#` before numbers and names of users.
        """
        kinds = ("ID", "student_id", "login", "email")
        cells = {kind: self.value(row, kind).removeprefix("#") for kind in kinds if kind in self.columns}
        name = self.value(row, "name")
        if {"last", "first"} <= self.columns.keys():
            name = f"{self.value(row, 'last')}, {self.value(row, 'first')}"
        if all(_MANUAL.fullmatch(cell) for cell in (*cells.values(), name.strip(", "))):
            return {}
        return {**cells, "name": name}

    @staticmethod
    def evidence(student_id: str, person: Person) -> Evidence:
        """Names are the weakest."""
        return (
            ("ID", person.platform_id),
            ("student_id", student_id),
            ("login", person.username or student_id),
            ("login", person.email),
            ("email", person.email),
            ("name", person.name),
        )

    def put_grade(self, row: int, text: str) -> bool:
        """Put a grade into its cell; in a status file of ILIAS the row must say that it is to be read."""
        if "update" in self.columns:
            self.table.put(row, self.columns["update"], "1")
        return Form.put_grade(self, row, text)


def grades_file(grades: Sequence[Grade], options: Options) -> Delivery:
    """The exported gradebook filled in where there is one, else one made anew."""
    if options.form is None:
        return gradebook(grades, options)
    return fill_gradebook(bytes_of(options.form, "form_missing"), options.form_name, grades, options)


_UTF_16 = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}


def fill_gradebook(data: bytes, file: str, grades: Sequence[Grade], options: Options) -> Delivery:
    """Fill in an exported gradebook; one of Blackboard's in UTF-16 stays so.

    Raises InputFileError for a file that is none, CallError where the assignment is not named or its
    maximum is another, or not stated.
    """
    encoding = _UTF_16.get(data[:2], "utf-8") if options.to == "blackboard" else "utf-8"
    if encoding != "utf-8":
        data = data.decode(encoding, errors="replace").encode("utf-8")
    form = Gradebook.opened(data, file, options.item)
    asked = LAYOUTS[options.to].platform
    if not form.people:
        raise _refused(file, asked, Reason("no_students"))
    if form.platform != asked:
        raise _refused(file, asked, Reason("of_platform", {"platform": form.platform}))
    if form.possible and options.maximum is not None:
        raise failure(CallError, "option_unused", "maximum_stated", other="--gradebook")
    comments = {grade.student_id: plain_comment(grade) for grade in ready(grades)}
    delivery = fill_in(form, file, grades, options, comments if "feedback" in form.columns else {})
    if encoding == "utf-8" or not isinstance(delivery.content, bytes):
        return delivery
    return replace(delivery, content=delivery.content.decode("utf-8").encode(encoding))


def _layout(header: Sequence[str], file: str) -> Layout:
    """The platform whose columns these are."""
    for layout in LAYOUTS.values():
        if all(any(name in header for name in each.split("|")) for each in layout.required):
            return layout
    known = " / ".join(layout.platform for layout in LAYOUTS.values())
    raise _refused(file, known, Reason("columns_unknown", {"table_row": 1, "names": tuple(header[:8])}))


def _refused(file: str, platform: str, *faults: Reason) -> InputFileError:
    return failure(InputFileError, "gradebook_file", faults=faults, file=file, platform=platform)


def _assignment(header: Sequence[str], first: int, layout: Layout, wanted: str, file: str) -> int:
    """The assignment's column from `first` on: named by its header, title or number, or the only one."""
    known = {
        place: match
        for place, title in enumerate(header)
        if place >= first and (match := layout.item.fullmatch(title))
    }
    fitting = [place for place in known if not wanted or header[place] == wanted]
    if wanted and not fitting:
        fitting = [place for place, match in known.items() if wanted in (match["title"], match["id"])]
    if len(fitting) == 1:
        return fitting[0]
    choices = ", ".join(f"'{header[place]}'" for place in known) or "none"
    told = {"file": file, "count": len(fitting), "item": wanted, "choices": choices}
    raise failure(CallError, "item", "" if wanted else "item_open", **told)


# Feedback files of ILIAS --------------------------------------------------------------------------

_FOLDER = re.compile(r"(multi_feedback[^/]*/[^/]*?_(?P<login>[^/_]+)_(?P<id>\d+))/.*")
"""Last name, first name, login and number in ILIAS (ilExAssignment::sendMultiFeedbackStructureFile)."""


def feedback_files(grades: Sequence[Grade], options: Options) -> Delivery:
    """The pages of those who have a grade, in the folders of ILIAS's downloaded archive for multi-feedback.

    Raises CallError where the archive is not given, InputFileError for another one, and for missing pages.
    """
    if options.form is None:
        raise failure(CallError, "gradebook_needed", "archive_needed")
    try:
        with zipfile.ZipFile(options.form) as archive:
            found = {match[1]: match for name in archive.namelist() if (match := _FOLDER.fullmatch(name))}
    except (OSError, zipfile.BadZipFile) as error:
        known = {"file": options.form, "error": error}
        raise failure(InputFileError, "gradebook_file", "no_archive", **known) from error
    if not found:
        raise failure(InputFileError, "gradebook_file", "archive_folders", file=options.form)
    folders = list(found)
    rows = {row: {"ID": match["id"], "login": match["login"]} for row, match in enumerate(found.values())}
    matches = match_class(rows, grades, options, Gradebook.evidence)
    own = {student: folders[row] for student, row in matches.rows.items()}
    files = pages_in(own, ready(grades), options.out or Path())
    graded = {grade.student_id for grade in ready(grades)}
    return Delivery(files, unplaced={who: why for who, why in matches.missing.items() if who in graded})
