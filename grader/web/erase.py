"""Delete everything about one student from a publication: rows, files, results."""

import csv
import io
import shutil
from collections.abc import Iterable
from pathlib import Path, PurePath

from sqlalchemy import delete, or_, select
from sqlalchemy.orm import Session

from grader.documents import ResultsDocument
from grader.files import result_folders, write_whole
from grader.folder.changes import CACHE_FOLDER, RUN_NOTE
from grader.lms.assessments import write_documents
from grader.lms.export import read_results
from grader.owners.platforms import owners_by_platform
from grader.tables.decisions import DecisionFile
from grader.tables.measurements import students_in
from grader.tables.reader import MARK, decoded
from grader.tables.roster import read_roster
from grader.web.places import Places
from grader.web.store import Attempt, Audit, Job, Link, LtiClaim, Publication, Regrading, Sheet, digest_of
from reference.authored.variant_table import delimiter_of

PAGES = ("index.html", "summary.csv")
"""Files of the whole class: they name the student, and the next run writes them again."""


def erase_student(session: Session, publication: Publication, places: Places, student: str) -> list[str]:
    """Delete a student; return the names of the files that stay because they hold others, too.

    The class must not be graded meanwhile.
    """
    for table in (Link, Regrading, Sheet, LtiClaim):
        session.execute(
            delete(table).where(table.publication_id == publication.id, table.student_id == student)
        )
    who = f"student:{student}"
    session.execute(delete(Attempt).where(Attempt.publication_id == publication.id, Attempt.who == who))
    session.execute(delete(Job).where(Job.publication_id == publication.id, Job.sender == who))
    rows = read_roster(places.roster).rows if places.roster.is_file() else ()
    students = {student, *(row.student_id for row in rows)}
    _erase_audit(session, publication, student, students)
    owners = _owners(places)
    own = {
        path for path, name in places.called().items()
        if owners.get(name, {_student_named(PurePath(name).stem, students)}) == {student}
    }  # fmt: skip
    shared = [name for name, students in owners.items() if student in students and len(students) > 1]
    for path in own:
        places.delete(path)
    _erase_rows(places, student)
    _erase_results(places, student)
    shutil.rmtree(places.exports, ignore_errors=True)
    return shared


def _owners(places: Places) -> dict[str, set[str]]:
    """Return the owners of each file, as the last run found them, or as the table has them."""
    by_platform = owners_by_platform(places.called().values(), places.listed())
    owners = {name: {one} for name, one in by_platform.items() if isinstance(one, str)}
    for report in _reports(places).reports:
        for sheet in report.reading.sheets:
            owners.setdefault(sheet.source, set()).add(report.student_id)
    for path, name in places.called().items():
        if path.suffix.lower() in {".csv", ".json"} and (students := students_in(path)):
            owners[name] = set(students)
    return owners


def _reports(places: Places) -> ResultsDocument:
    if not (places.results / "results.json").is_file():
        return ResultsDocument(assignment="", reports=[])
    return read_results(places.results)


def _student_named(stem: str, students: Iterable[str]) -> str | None:
    """Return the student whose id begins a file's name: of ``s1`` and ``s1_2`` the longer one."""
    return max((one for one in students if f"{stem}_".startswith(f"{one}_")), key=len, default=None)


def _erase_audit(session: Session, publication: Publication, student: str, students: Iterable[str]) -> None:
    """Replace the student's id, and names of files that begin with it, by a digest."""
    told = Audit.about.startswith(f"{publication.key} ", autoescape=True)
    texts = (Audit.about, Audit.before, Audit.after)
    named = or_(*(text.contains(student, autoescape=True) for text in texts))
    for entry in session.scalars(select(Audit).where(told, named)):
        for text in texts:
            words = getattr(entry, text.key).split(" ")
            setattr(entry, text.key, " ".join(_without(word, student, students) for word in words))


def _without(word: str, student: str, students: Iterable[str]) -> str:
    """Return a word of the audit trail; a digest if it is the student, or a file or page of theirs."""
    bare = word.removeprefix("page:").removeprefix("owner=").rstrip(";:")
    is_own = student in {bare, _student_named(Path(bare).stem, students)}
    return f"({digest_of(student)[:8]})" if is_own else word


def _erase_rows(places: Places, student: str) -> None:
    """Remove the student's lines from the roster and the decisions."""
    if places.roster.is_file():
        text = decoded(places.roster.read_bytes()).removeprefix(MARK)
        lines = list(io.StringIO(text, newline=""))
        gone = {row.line for row in read_roster(places.roster).rows_of(student)}
        kept, begin = list[str](), 0
        reader = csv.reader(lines, delimiter=delimiter_of(text))
        for _ in reader:  # a record may have several lines
            kept += [] if begin + 1 in gone else lines[begin : reader.line_num]
            begin = reader.line_num
        write_whole(places.roster, "".join(kept))
    decisions = DecisionFile(places.handed_in / "decisions.csv")
    if decisions.path.is_file():
        decisions.remove(*(row for row in decisions.all() if row.student_id == student))


def _erase_results(places: Places, student: str) -> None:
    results = _reports(places)
    if not results.assignment:
        return
    for folder, report in zip(result_folders(results.reports), results.reports, strict=True):
        if report.student_id == student:
            name = folder.replace("/", "#")
            for path in (places.results / CACHE_FOLDER).rglob(f"{name}.*"):
                path.unlink(missing_ok=True)
    shutil.rmtree(places.results / student, ignore_errors=True)
    kept = results.model_copy(
        update={
            "reports": [one for one in results.reports if one.student_id != student],
            "moved": [one for one in results.moved if one.student_id != student],
            "alike": [one for one in results.alike if student not in one.students],
            "stale": [one for one in results.stale if one.student_id != student],
        }
    )
    notes = (note for note in (places.results / CACHE_FOLDER).glob("*.json") if note.name != RUN_NOTE)
    for path in (*(places.results / page for page in PAGES), *notes):
        path.unlink(missing_ok=True)
    if kept.rubric is not None:
        write_documents(places.results, kept)
    write_whole(places.results / "results.json", kept.model_dump_json(indent=2))
