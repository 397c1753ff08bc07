"""Moodle's tables: the offline grading worksheet filled in, the gradebook import, the archive of feedback.

Worksheet: only the cells of *Grade* and *Feedback comments* change. Moodle takes `7,5` for 7, `abc` for
0, skips what is above the maximum and rejects ragged files without saying what is wrong: all of that
is refused here.

Gradebook: the first bad row aborts Moodle's whole import, so every row is checked here. Students without
a grade have no row: in a new grade item Moodle would store a blank as 0, and in an old one `-` takes back
what a teacher has entered. Decimal dots, whatever the language of the site.

Feedback: a folder `Participant_<n>_assignfeedback_file_` for each student. Moodle splits a folder's name at
its underscores, so a file's own name has none; before 4.1 it passes over a folder without the last one.
"""

import json
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Self

from grader.files import is_formula
from grader.lms.grades import Delivery, Grade, Options, Person, ready
from grader.lms.marks import comment
from grader.lms.table import (
    NO_GRADE,
    Evidence,
    Form,
    RawTable,
    bytes_of,
    csv_text,
    fill_in,
    number,
    parse,
)
from grader.records import Reason
from grader.texts.spoken import failure
from reference.errors import CallError, InputFileError

# The worksheet ------------------------------------------------------------------------------------

COLUMNS: dict[str, tuple[str, ...]] = {
    "identifier": ("identifier", "identificator", "идентификатор"),
    "name": ("full name", "nume complet", "nume / prenume", "полное имя", "фио", "имя / фамилия"),
    "id": ("id number", "număr id", "cod numeric", "индивидуальный номер"),
    "username": ("username", "nume utilizator", "nume de utilizator", "логин"),
    "email": (
        "email address", "adresă de email", "adresa de email", "adresa de e-mail",
        "адрес электронной почты",
    ),
    "status": ("status", "статус", "statut", "estado", "stato", "állapot", "stav", "tila"),
    "group": (
        "group", "grup", "группа", "группы", "gruppe", "groupe", "grupo", "gruppo", "groep", "група",
        "grupp", "grupa", "skupina", "csoport", "ryhmä", "grupė", "taldea", "ομάδα", "المجموعة",
        "グループ", "小组", "小組", "그룹",
    ),
    "marker": ("marker", "оценщик"),
    "grade": ("grade", "notă", "nota", "оценка"),
    "maximum": ("maximum grade", "notă maximă", "nota maximă", "максимальная оценка"),
    "scale": ("scale", "scală", "scala", "шкала"),
    "workflow": ("marking workflow state", "starea fluxului de notare", "этап процесса оценивания"),
    "changeable": ("grade can be changed", "nota poate fi schimbată", "оценка может быть изменена"),
    "modified": (
        "last modified (grade)", "ultima modificare (nota)", "ultima modificare (notă)",
        "последнее изменение (оценка)",
    ),
    "feedback": (
        "feedback comments", "comentarii de feedback", "comentarii feedback",
        "feedback sub formă de comentarii", "отзыв в виде комментария", "отзыв в виде комментариев",
    ),
}  # fmt: skip
"""Moodle's column names in the languages in which worksheets are likely to be downloaded, in small letters.

Of other languages the columns are known by what stands in them.
"""

_REQUIRED = ("identifier", "grade", "modified")
_NO = {
    "no", "nu", "нет", "nein", "non", "não", "nee", "nej", "nie", "ні", "hayır", "όχι", "ne", "ez", "لا",
    "否",
}  # fmt: skip
"""Moodle's "no", in each of its languages, to the question whether a grade can be changed."""
_PARTICIPANT = re.compile(r"([^\W\d_]\D*?)([0-9]+)")
"""The word for a participant in the site's language, in some with a space, and the number."""
_AMOUNT = re.compile(r"\d+([.,]\d+)?")
_ADDRESS = re.compile(r"[^@\s]+@[^@\s]+")
_MOMENT = re.compile(r".*\d:\d\d.*")
_ENGLISH = re.compile(
    r"((mon|tue|wed|thu|fri|sat|sun|tues|wednes|thurs|satur)(day)?|am|pm|st|nd|rd|th|may|june?|july?"
    r"|jan(uary)?|feb(ruary)?|mar(ch)?|apr(il)?|aug(ust)?|sept?(ember)?|oct(ober)?|(nov|dec)(ember)?)"
)
"""The words in dates that PHP's strtotime reads."""
_ISO = re.compile(r"\d{4}-\d\d-\d\dT?.*")
_MONTHS = {
    word: month
    for month, words in enumerate((
        "ianuarie январь января", "februarie февраль февраля", "martie март марта", "aprilie апрель апреля",
        "mai май мая", "iunie июнь июня", "iulie июль июля", "august август августа",
        "septembrie сентябрь сентября", "octombrie октябрь октября", "noiembrie ноябрь ноября",
        "decembrie декабрь декабря",
    ), start=1)
    for word in words.split()
}  # fmt: skip
"""Whole names: by their beginnings a Finnish November would be a March."""
_WRITTEN = re.compile(
    r"\D*(?P<day>\d{1,2})\.? (?P<month>[^\W\d_]+) (?P<year>\d{4})(?: ?г\.| года)?,? (?P<hour>\d{1,2})"
    r":(?P<minute>\d\d)(?: ?(?P<half>[ap]\.?m\.?|до полудня|после полудня))?"
)
"""Moodle's strftimedaydatetime in its Romanian and Russian packs, with 12 or 24 hours, over its versions."""


@dataclass(slots=True)
class Worksheet(Form):
    """A worksheet that Moodle would take."""

    platform: str = "Moodle"
    replaced = "changed_if_fresh"

    @classmethod
    def opened(cls, data: bytes, file: str, item: str = "") -> Self:  # noqa: ARG003 - a worksheet is of one item
        """A worksheet as downloaded; InputFileError with everything that Moodle would not take."""
        table = parse(data, file)
        if not table.rows:
            raise failure(InputFileError, "worksheet", "worksheet_empty", file=file)
        columns = _columns(table, file)
        at, names = {"table_row": 1}, tuple(map(str.strip, table.header()))
        missing = [COLUMNS[name][0].capitalize() for name in _REQUIRED if name not in columns]
        faults = [Reason("column_missing", {**at, "name": name, "names": names}) for name in missing]
        if "scale" in columns:
            faults.append(Reason("scale_graded", at))
        if columns.get("feedback") == 0:
            faults.append(Reason("comments_first", at))
        faults += table.ragged()
        sheet = cls(table, columns)
        if not faults:
            faults += _row_faults(sheet)
        if faults:
            raise failure(InputFileError, "worksheet", faults=faults, file=file)
        sheet.notes += [] if columns.keys() & {"name", "email", "id", "username"} else [Reason("anonymous")]
        sheet.notes += [Reason("workflow")] if "workflow" in columns else []
        return sheet

    @staticmethod
    def amount(text: str) -> float | None:
        """A number that is not negative as Moodle writes it: 10.00, or 10,00 in many languages."""
        plain = text.strip().replace("\u00a0", "").replace(",", ".")
        return float(plain) if re.fullmatch(r"\d+(\.\d+)?", plain) else None

    def why_fixed(self, row: int) -> Reason | None:
        """Return a reason if Moodle says that the grade cannot be changed."""
        return Reason("grade_locked") if self.value(row, "changeable").casefold() in _NO else None

    def participant(self, row: int) -> int | None:
        """The participant's number, by which Moodle knows the row."""
        match = _PARTICIPANT.fullmatch(self.value(row, "identifier"))
        return None if match is None else int(match[2])

    def decimals(self, row: int) -> int:
        """As many as the maximum is written with."""
        return len(self.value(row, "maximum").replace(",", ".").partition(".")[2]) or 2

    def notes_on(self, changed: int, zeros: Sequence[str]) -> Sequence[Reason]:
        """The worksheet does not say of which assignment it is; Moodle's count does."""
        note = Reason("updates", {"count": changed})
        return [note, Reason("zeros", {"names": tuple(zeros)})] if zeros else [note]

    def date_by(self, downloaded: datetime) -> None:
        """Write dates as ISO: of another language than English Moodle reads none, and updates nothing.

        Moodle skips what was graded after a date. One in Romanian or Russian stays the same local time,
        without a zone, as it stands in an English worksheet; others become the time of the file.
        Source: assignfeedback_offline_grade_importer::next takes them by PHP's strtotime, in the site's zone.
        """
        is_unknown = False
        for row in self.people:
            if not _is_read_by_moodle(written := self.value(row, "modified")):
                moment = _moment(written)
                is_unknown |= moment is None
                iso = f"{moment:%Y-%m-%d %H:%M}" if moment else downloaded.isoformat(timespec="seconds")
                self.table.put(row, self.columns["modified"], iso)
        if is_unknown:
            at = downloaded.isoformat(sep=" ", timespec="minutes")
            self.notes.append(Reason("dates_of_file", {"moment": at}))

    @property
    def group_columns(self) -> list[int]:
        """Columns that are, or may be, those of groups: between a student's status and the grade.

        Source: mod/assign/gradingtable.php, assign_grading_table::__construct.
        """
        if "group" in self.columns:
            return [self.columns["group"]]
        who = [self.columns.get(name, 0) for name in ("identifier", "name", "id", "username", "email")]
        others = [
            place
            for place in range(self.columns.get("status", max(who)) + 1, self.columns["grade"])
            if place not in self.columns.values()
            and not all(
                map(_MOMENT.fullmatch, {self.table.value(row, place) for row in self.people} - NO_GRADE)
            )
        ]
        # The status itself is one of them where its heading is not known.
        return others if "status" in self.columns or len(others) > 1 else []

    def identity(self, row: int) -> Mapping[str, str]:
        """Participant's number, address, ID number, username and name."""
        known = [name for name in ("email", "id", "username", "name") if name in self.columns]
        return {"participant": str(self.participant(row)), **{name: self.value(row, name) for name in known}}

    @staticmethod
    def evidence(student_id: str, person: Person) -> Evidence:
        """Names are the weakest."""
        return (
            ("participant", "" if person.participant is None else str(person.participant)),
            ("email", person.email),
            ("id", student_id),
            ("username", person.username),
            ("name", person.name),
        )


def grades_file(grades: Sequence[Grade], options: Options) -> Delivery:
    """The worksheet filled in where there is one, else the gradebook import."""
    if options.form is None:
        return gradebook(grades, options)
    comments = {grade.student_id: comment(grade) for grade in ready(grades)}
    data = bytes_of(options.form, "form_missing")
    downloaded = datetime.fromtimestamp(int(options.form.stat().st_mtime), UTC)
    return fill_worksheet(data, options.form_name, grades, options, comments, downloaded)


def fill_worksheet(
    data: bytes,
    file: str,
    grades: Sequence[Grade],
    options: Options,
    comments: Mapping[str, str],
    downloaded: datetime,
) -> Delivery:
    """Fill in a worksheet; `comments` are HTML by student_id, not written where there is no column for them.

    Raises InputFileError with everything that is wrong with the worksheet, CallError for options that
    mean nothing here.
    """
    for name in ("item", "identity"):
        if getattr(options, name):
            known = {"option": f"--{name}", "other": "--worksheet"}
            raise failure(CallError, "option_unused", "unused_beside", **known)
    sheet = Worksheet.opened(data, file)
    if options.maximum is not None and "maximum" in sheet.columns:
        raise failure(CallError, "option_unused", "maximum_stated", other="--worksheet")
    sheet.date_by(downloaded)
    if "feedback" not in sheet.columns:
        sheet.notes.append(Reason("no_comments"))
    return fill_in(sheet, file, grades, options, comments)


def _columns(table: RawTable, file: str) -> dict[str, int]:
    """Places of columns by our names: by their headings, else by what stands in them.

    Their order is Moodle's own: identifier, full name, ..., grade, maximum, ..., date of the grade,
    comments.

    Raises InputFileError where a heading stands twice.
    """
    header = [title.strip().casefold() for title in table.header()]
    columns: dict[str, int] = {}
    for name, known in COLUMNS.items():
        places = [place for place, title in enumerate(header) if title in known]
        if len(places) > 1:
            known_there = {"file": file, "count": len(places), "name": table.value(0, places[0])}
            raise failure(InputFileError, "worksheet", "worksheet_column", **known_there)
        if places:
            columns[name] = places[0]
    free = [place for place in range(len(header)) if place not in columns.values()]
    cells = {
        place: {
            table.value(row, place).strip()
            for row in range(1, len(table.rows))
            if place < len(table.rows[row])
        }
        for place in free
    }

    def fill(name: str, places: Iterable[int]) -> None:
        place = next((place for place in places if place in cells), None)
        if name not in columns and place is not None:
            columns[name] = place
            del cells[place]

    def all_are(shape: re.Pattern[str], place: int, but: Collection[str] = ()) -> bool:
        """Return whether a column has only such cells, besides those that are also allowed."""
        texts = cells.get(place, set())
        return bool(texts) and all(map(shape.fullmatch, texts - set(but)))

    fill("identifier", [place for place in free if all_are(_PARTICIPANT, place)])
    fill(
        "email",
        [place for place in free if all_are(_ADDRESS, place, NO_GRADE) and not cells[place] <= NO_GRADE],
    )
    fill("name", [columns.get("identifier", -2) + 1])
    for place in free:
        left = place - 1
        if all_are(_AMOUNT, place) and (columns.get("grade") == left or all_are(_AMOUNT, left, NO_GRADE)):
            fill("maximum", [place])
    fill("grade", [columns.get("maximum", -2) - 1])
    fill("changeable", [place for place in free if {text.casefold() for text in cells.get(place, ())} & _NO])
    fill("modified", [place for place in reversed(free) if all_are(_MOMENT, place, {"-"})])
    # Of several columns after it none is surely that of comments.
    fill("feedback", {columns.get("modified", -2) + 1} & {len(header) - 1})
    return columns


def _is_read_by_moodle(moment: str) -> bool:
    """Return whether PHP's strtotime reads a date; a dash is no date."""
    words = set(re.findall(r"[^\W\d_]+", moment.casefold()))
    return (
        moment in NO_GRADE
        or bool(_ISO.fullmatch(moment))
        or (bool(words) and all(map(_ENGLISH.fullmatch, words)))
    )


def _moment(written: str) -> datetime | None:
    """Return a date as Moodle writes it in Romanian or Russian; None for another one."""
    found = _WRITTEN.fullmatch(" ".join(written.casefold().split()))
    month = _MONTHS.get(found["month"]) if found else None
    if found is None or month is None:
        return None
    hour, half = int(found["hour"]), found["half"]
    hour = hour % 12 + 12 * (half[0] in "pп") if half else hour
    try:
        return datetime(int(found["year"]), month, int(found["day"]), hour, int(found["minute"]))  # noqa: DTZ001 - the site's zone
    except ValueError:
        return None


def _row_faults(sheet: Worksheet) -> Iterator[Reason]:
    words = {
        match[1] for row in sheet.people if (match := _PARTICIPANT.fullmatch(sheet.value(row, "identifier")))
    }
    if len(words) > 1:
        yield Reason("participant_words", {"names": tuple(map(repr, sorted(words)))})
    rows: dict[int, int] = {}
    comma = sheet.value(0, "grade").casefold() != COLUMNS["grade"][0]
    for row in sheet.people:
        participant, maximum, at = sheet.participant(row), sheet.maximum(row), {"table_row": row + 1}
        if participant is None:
            yield Reason("participant_form", {**at, "text": sheet.value(row, "identifier")})
            continue
        if participant in rows:
            yield Reason("participant_twice", {**at, "first": rows[participant]})
        rows[participant] = row + 1
        if "maximum" in sheet.columns and not maximum:
            yield Reason("maximum_wrong", {**at, "text": sheet.value(row, "maximum")})
        grade = sheet.value(row, "grade")
        if code := _misread(grade, maximum, comma=comma):
            yield Reason(code, {**at, "text": grade, "whole": grade.partition(",")[0]})


def _misread(text: str, maximum: float | None, *, comma: bool) -> str:
    """Return the code of what Moodle would misread in a grade that is there already; empty if nothing."""
    value = Worksheet.amount(text)
    if text in NO_GRADE:
        return ""
    if value is None:
        return "grade_no_number"
    if "," in text and not comma:
        return "grade_comma"
    return "grade_above" if maximum and value > maximum else ""


# The gradebook ------------------------------------------------------------------------------------

IDENTITIES = ("idnumber", "email", "username", "id")
_SHAPES = {
    "email": re.compile(r"[^@\s]+@[^@\s]+\.[^@\s]+"),
    "id": re.compile(r"[1-9][0-9]*"),
    # Moodle's own rule for usernames: lower case, digits, and these marks.
    "username": re.compile(r"[a-z0-9._@-]+"),
}
_USUAL_LIMIT = 100.0
"""Above it Moodle aborts the import, unless the site allows unlimited grades."""
_LONGEST_COMMENT = 60_000
"""Characters; MySQL's text columns hold 65,535 bytes."""


def gradebook(grades: Sequence[Grade], options: Options) -> Delivery:
    """The import file: a row per user, users by idnumber, email, username or id.

    Raises CallError with every student who cannot be named, named twice, or whose grade does not fit.
    """
    identity = options.identity or "idnumber"
    if identity not in IDENTITIES:
        raise failure(CallError, "identity", names=IDENTITIES, text=identity)
    item = options.item.strip() or grades[0].assignment
    if is_formula(item):
        raise failure(CallError, "gradebook", "item_formula", item=item)
    graded = ready(grades)
    comments = [comment(grade) for grade in graded]
    faults = list(_faults(graded, identity))
    faults += [
        Reason("comment_long", {"cell": grade.student_id, "most": _LONGEST_COMMENT})
        for grade, text in zip(graded, comments, strict=True)
        if len(text) > _LONGEST_COMMENT
    ]
    if faults:
        raise failure(CallError, "gradebook", "import_aborted", faults=faults)
    scores = [grade.out_of(options.maximum, rescale=options.rescale) for grade in graded]
    users = [_user(grade, identity) for grade in graded]
    rows = zip(users, [number(score, 2) for score in scores], comments, strict=True)
    maximum = options.maximum or max((grade.max_score for grade in graded), default=0.0)
    notes = [Reason("worksheet_better"), Reason("item_first", {"most_points": maximum})]
    notes += [Reason("no_row")] if len(graded) < len(grades) else []
    notes += [Reason("above_hundred")] if any(score > _USUAL_LIMIT for score in scores) else []
    return Delivery(csv_text([identity, item, f"{item} (feedback)"], rows), notes=tuple(notes))


def _user(grade: Grade, identity: str) -> str:
    person, student_id = grade.person, grade.student_id
    names = {"email": person.email, "username": person.username, "id": person.platform_id or student_id}
    return names.get(identity, student_id)


def _faults(grades: Sequence[Grade], identity: str) -> Iterator[Reason]:
    owner: dict[str, str] = {}
    for grade in grades:
        name, shape = _user(grade, identity), _SHAPES.get(identity)
        known = {"cell": grade.student_id, "column": identity, "text": name}
        if not name:
            yield Reason("identity_missing", known)
        elif is_formula(name):
            yield Reason("formula", known)
        elif shape is not None and not shape.fullmatch(name):
            yield Reason("identity_unknown", known)
        elif name.casefold() in owner:
            yield Reason("same_user", {**known, "other": owner[name.casefold()]})
        owner.setdefault(name.casefold(), grade.student_id)


# Feedback files -----------------------------------------------------------------------------------

FEEDBACK_FILES = ("feedback.html", "feedback.pdf")
"""The page must be there; the PDF may."""


def feedback_files(grades: Sequence[Grade], options: Options) -> Delivery:
    """The archive's files.

    The worksheet has the number that Moodle gave each participant; without it the table of ids must.

    Raises CallError where neither has the numbers, InputFileError for pages that are missing or of
    another run.
    """
    graded = ready(grades)
    numbers, why, notes = _participants(grades, options)
    missing = {grade.student_id: why[grade.student_id] for grade in graded if grade.student_id in why}
    folders = {who: f"Participant_{number}_assignfeedback_file_" for who, number in numbers.items()}
    files = pages_in(folders, graded, options.out or Path())
    if missing and not files:
        faults = [Reason("no_number_known", {"cell": student}) for student in missing]
        raise failure(CallError, "nothing_to_export", "no_numbers", faults=faults)
    return Delivery(files, unplaced=missing, notes=(Reason("grades_first"), *notes))


def _participants(
    grades: Sequence[Grade], options: Options
) -> tuple[dict[str, int], dict[str, Reason], list[Reason]]:
    """Moodle's number of each participant, why others have none, and what a person should check.

    In the archive of groups Moodle takes a number for a group's: others would get the page.
    Source: mod/assign/feedback/file/importziplib.php, get_participant_mapping.
    """
    people = {grade.student_id: grade.person for grade in grades}
    if options.groups:
        raise failure(CallError, "groups", found="--groups")
    if options.form is None:
        numbers = {student: who.participant for student, who in people.items() if who.participant is not None}
        if all(person.participant is None for person in options.people.values()):
            raise failure(CallError, "worksheet_needed")
        others = people.keys() - numbers.keys()
        notes = [] if options.groups is False else [Reason("not_for_groups")]
        return numbers, dict.fromkeys(others, Reason("participant_absent")), notes
    sheet = Worksheet.opened(bytes_of(options.form, "form_missing"), options.form_name)
    if "group" in sheet.columns or (options.groups is None and sheet.group_columns):
        titles = tuple(f"'{sheet.table.value(0, place)}'" for place in sheet.group_columns)
        raise failure(CallError, "groups", "" if "group" in sheet.columns else "groups_maybe", found=titles)
    matches = sheet.match(grades, options)
    rows = {student: row for student, row in matches.rows.items() if student in people}
    locked = {student: why for student, row in rows.items() if (why := sheet.why_fixed(row))}
    numbers = {student: sheet.participant(row) or 0 for student, row in rows.items() if student not in locked}
    doubtful = matches.notes_on(grade.student_id for grade in ready(grades) if grade.student_id in numbers)
    return numbers, {**matches.missing, **locked}, [*doubtful, *sheet.notes]


def pages_in(folders: Mapping[str, str], graded: Sequence[Grade], out: Path) -> dict[str, Path]:
    """The pages of students below their folders in an archive.

    Raises InputFileError for pages that are missing, or of another run than the results.
    """
    files: dict[str, Path] = {}
    faults: list[Reason] = []
    for grade in graded:
        if grade.student_id in folders:
            files.update(_pages(grade, out, folders[grade.student_id], faults))
    if faults:
        raise failure(InputFileError, "feedback_missing", faults=faults)
    return files


def _pages(grade: Grade, out: Path, folder: str, faults: list[Reason]) -> Iterator[tuple[str, Path]]:
    """A student's pages by their names in the archive; what is missing or of another run goes to `faults`."""
    for report, where in zip(grade.reports, grade.folders, strict=True):
        before = "" if len(grade.reports) == 1 else f"position-{where.rpartition('/')[2]}-"
        at = {"cell": str(out / where)}
        try:
            written = json.loads((out / where / "report.json").read_bytes())
            if (written["status"], written["score"]) != (report.status, report.score):
                faults.append(Reason("other_result", at))
        except (OSError, ValueError, KeyError, TypeError) as error:
            why = str(getattr(error, "strerror", None) or error)
            faults.append(Reason("not_readable", {**at, "error": why}))
        page, *printable = (out / where / name for name in FEEDBACK_FILES)
        if not page.is_file():
            faults.append(Reason("page_absent", {"cell": str(page)}))
        for file in (page, *printable):
            if file.is_file():
                yield f"{folder}/{before}{file.name}", file
