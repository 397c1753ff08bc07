"""A class under review: its questions, the decisions on them, and their immediate consequences.

The file of decisions is the only thing that is kept. Reports in memory are of the decisions in it; results
and pages on the disk are of the last run, and `bring_up_to_date` makes them anew.
"""

import math
import threading
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import count

from grader.comparison.task import task_of
from grader.documents import (
    CriterionDocument,
    FigureDocument,
    ProblemDocument,
    ReportDocument,
    ResultsDocument,
    StandingDocument,
)
from grader.feedback.numbers import shown
from grader.files import Stamp, stamp_of
from grader.folder.batch import Batch, Graded, graded, pages_read
from grader.folder.decisions import basis_of, decided, page_basis
from grader.folder.workers import Pool
from grader.marking.decided import strokes_on, why_not
from grader.marking.trust import opened_in, trust_of
from grader.overlay.scene import Arrow, Ghost, Scene, expected_vector, ghost_of, scene_of
from grader.pipeline import mark
from grader.reading.corrected import snapped
from grader.reading.orders import corners_of, ends_on_sheet
from grader.records import MECHANISM, PageRef, ScannedPage, on_sheet
from grader.review.doubts import Doubt, doubts_of, figure_of, figures_read, in_order, reading_of
from grader.review.records import (
    OPEN,
    Answer,
    Change,
    ChangedError,
    Corner,
    Drawn,
    Kept,
    Request,
    Standing,
    Student,
    Whole,
    mark_of,
)
from grader.review.scans import Scans
from grader.scan.page import NO_DRAWINGS
from grader.tables.decisions import ClashError, Decision, DecisionFile, Key
from grader.tables.measurements import StudentSubmission
from grader.tables.reader import TableError, at
from grader.texts.spoken import RefusedError
from reference.construction.graph import Construction
from reference.quantities import group_of

MOST_COMMENTS = 200
"""Kept comments that are offered, those of all criteria together."""


@dataclass(slots=True)
class Run:
    """A run in the background that brings the class up to date, and what a page shows of it."""

    running: bool = False
    progress: str = ""
    message: str = ""
    summary: str = ""
    changes: list[str] = field(default_factory=list)
    files: list[dict[str, str]] = field(default_factory=list)


Note = Callable[[str, str, str, str], None]
"""Called with a change of a mark: who made it, what it is about, before, after."""


def moves(results: ResultsDocument) -> Iterator[tuple[str, str, str]]:
    """Yield the marks that a run changed: about whom, before, after."""
    for one in results.moved:
        about = one.student_id if one.position is None else f"{one.student_id} {one.position}"
        yield about, _stands(one.before), _stands(one.after)


def _stands(standing: StandingDocument | None) -> str:
    if standing is None:
        return ""
    return standing.status if standing.score is None else f"{shown(standing.score):g}"


@dataclass(slots=True)
class Session:
    """One class, for several people at once; every method may be called from any thread.

    Arguments
    ---------
    workers : what grades, processes of its own where not given
    note : is told of every change of a mark
    """

    batch: Batch
    workers: Pool | None = None
    students: list[Student] = field(default_factory=list)
    pages: tuple[PageRef, ...] = ()
    version: int = 0
    runs: int = 0
    made: int = 0
    """Number of decisions made here since the pages were brought up to date."""
    scans: Scans = field(default_factory=Scans)
    graded: Graded | None = None
    note: Note = lambda *_: None
    run: Run = field(default_factory=Run)
    _file: DecisionFile = field(init=False)
    _stamp: Stamp | None = None
    _rows: list[Decision] = field(default_factory=list)
    _undo: dict[str, list[Change]] = field(default_factory=dict)
    _lock: threading.RLock = field(default_factory=threading.RLock)

    def __post_init__(self) -> None:
        self._file = DecisionFile(self.batch.decisions_path)

    # The class ------------------------------------------------------------------------------------

    def bring_up_to_date(self, progress: Callable[[str, int, int], None], by: str = "") -> Graded:
        """Grade what has changed, so that results and pages on the disk have all decisions.

        Raises as `grader.folder.batch.graded`.

        Arguments: `by` is who asks for it.
        """
        stamp, made, rows = stamp_of(self._file.path), self.made, self._file.all()
        run = graded(self.batch, progress, self.workers)
        with self._lock:
            self.graded, self.pages = run, run.pages
            self.version, self.runs = self.version + 1, self.runs + 1
            self.students = [
                Student(number, job, report, job.submission.name, self.version)
                for number, (job, report) in enumerate(zip(run.jobs, run.results.reports, strict=True))
            ]
            people = dict.fromkeys(student.report.student_id for student in self.students)
            places = {one: place for place, one in enumerate(people)}
            for student in self.students:
                student.place = places[student.report.student_id]
                if student.report.status == "unreadable":
                    student.report = self._with_questions(student, student.job.submission)
            # What was decided meanwhile is taken in by the next `refresh`.
            self.made -= made
            self._stamp, self._rows = stamp, rows
        for about, before, after in moves(run.results):
            self.note(by, about, before, after)
        return run

    def student(self, key: str) -> Student:
        """Return a student by the key. Raises RefusedError."""
        for student in self.students:
            if student.key == key:
                return student
        raise RefusedError(400, "student_unknown", name=key)

    def pages_of(self, student: Student) -> list[ScannedPage]:
        """Return the pages as the last run read them."""
        if self.graded is None:
            return []
        if student.pages is None:
            pages = pages_read(self.batch, self.graded.cache, student.job)
            student.pages = [replace(page, backdrop=None) for page in pages]
        return student.pages

    def ask(self, requests: Mapping[tuple[str, int | None], Mapping[str, Request]]) -> None:
        """Take over the students' requests, by student and position, and criterion."""
        with self._lock:
            self.version += 1
            for student in self.students:
                own = requests.get((student.report.student_id, student.report.position), {})
                if own != student.requests:
                    student.requests, student.version = own, self.version

    # Decisions ------------------------------------------------------------------------------------

    def standing(self) -> Standing:
        """Read the decisions in force. Raises InputFileError for a file that people have broken."""
        return Standing(self._file.all())

    def decide(self, answers: Sequence[Answer], by: str, window: str) -> list[Student]:
        """Write decisions, all of them or none; return the students concerned, marked again.

        Raises ChangedError where somebody else was quicker, RefusedError for an answer that cannot be used.
        """
        with self._lock:
            wanted: list[tuple[Decision, str]] = []
            there = self.standing()
            for answer in answers:
                student = self.student(answer.student)
                if not answer.criterion.startswith("node:"):
                    student.criterion(answer.criterion.removeprefix("audit:").removeprefix("second:"))
                row = self._row(student, answer.criterion, answer.verdict, by, there)
                row = replace(row, comment=answer.comment, points=answer.points)
                self.check_points(row)
                wanted.append((row, answer.seen))
            self._write(wanted, there, window, by)
            return self._marked_anew({answer.student for answer in answers})

    def decide_whole(self, answer: Whole) -> list[Student]:
        """Write a comment on a whole submission and points added; an empty one takes it back.

        Raises as `decide`.
        """
        with self._lock:
            student, there = self.student(answer.student), self.standing()
            comment = replace(self._row(student, "comment", "", answer.by, there), comment=answer.comment)
            total = replace(self._row(student, "total", "", answer.by, there), points=answer.added)
            wanted = ((comment, answer.seen[0], answer.comment), (total, answer.seen[1], answer.added))
            gone = [
                (row, seen) for row, seen, said in wanted if not said and there.rows.get(row.key) is not None
            ]
            kept = [(row, seen) for row, seen, said in wanted if said]
            self._write(kept, there, answer.window, answer.by, gone)
            return self._marked_anew({answer.student})

    def decide_page(self, ref: PageRef, row: Decision, seen: str, window: str) -> None:
        """Write a page's owner, turn and corners; they count from the next run on.

        Raises as `decide`.
        """
        with self._lock:
            dated = replace(row, at=_now(), basis=page_basis(ref))
            self._write([(dated, seen)], self.standing(), window, row.by)

    def draw(self, said: Drawn) -> list[Student]:
        """Write strokes of ink on a student's page; none takes all ink there away.

        Raises as `decide`.
        """
        with self._lock:
            student, there = self.student(said.student), self.standing()
            page = self.page(student, said.sheet).ref
            taken = {
                row.criterion for row in there.rows.values() if row.student_id == student.report.student_id
            }
            names = (f"ink:{k}:{page.file}#{page.page}" for k in count(1))
            free = (name for name in names if name not in taken)
            texts = [" ".join(f"{x:.1f},{y:.1f}" for x, y in stroke) for stroke in said.strokes]
            new = [(self._row(student, next(free), text, said.by, there), "") for text in texts]
            own = [] if new else [(row, mark_of(row)) for row in self.ink(student, said.sheet)]
            self._write(new, there, said.window, said.by, own)
            return self._marked_anew({student.key})

    def ink(self, student: Student, sheet: int) -> list[Decision]:
        """Return the strokes of ink in force on one of a student's pages."""
        applied, ref = {row.criterion for row in student.report.decisions}, self.pages_of(student)[sheet].ref
        rows = [row for row in self.standing().rows.values() if row.student_id == student.report.student_id]
        return [row for row in strokes_on(ref, rows) if row.criterion in applied]

    def undo(self, window: str, by: str = "") -> tuple[list[Student], Decision | None]:
        """Take back the last decision of a window; return the students concerned, and a row of it.

        Raises ChangedError where somebody has changed it since.
        """
        with self._lock:
            changes = self._undo.get(window, [])
            if not changes:
                return [], None
            change = changes.pop()
            try:
                self._file.remove(*change.written, restored=change.before)
            except ClashError as error:
                raise ChangedError(error.rows[0] if error.rows else None) from error
            self.made -= 1
            self._tell(by, change.before, change.written)
            row = (*change.written, *change.before)[0]
            own = [one for one in self.students if one.report.student_id == row.student_id]
            fitting = [one for one in own if row.position in {None, one.report.position}]
            self._marked_anew(set())
            return fitting, row

    def kept(self) -> list[tuple[list[Decision], list[str]]]:
        """Return the comments kept for reuse, the commonest first: the decisions with it, the students' keys.

        Decisions on one criterion with the same verdict, points and words have the same comment.
        """
        keys = {(one.report.student_id, one.report.position): one.key for one in self.students}
        keys = {**{(student, None): key for (student, _), key in keys.items()}, **keys}
        groups: dict[tuple[object, ...], list[Decision]] = {}
        for row in self._file.all():
            if row.kind == "verdict" and row.comment and (row.student_id, row.position) in keys:
                groups.setdefault(_comment_of(row), []).append(row)
        common = sorted(groups.values(), key=len, reverse=True)[:MOST_COMMENTS]
        return [(rows, [keys[row.student_id, row.position] for row in rows]) for rows in common]

    def change_kept(self, said: Kept) -> list[Student]:
        """Give a kept comment other words or points, in all decisions that have it; return their students.

        Who decided, when, and about what stays: the verdicts are not decided again. Raises as `decide`, and
        RefusedError where other students have the comment than those that were shown.
        """
        with self._lock:
            there, asked = self.standing(), (said.criterion, said.verdict, said.points, said.comment)
            same = [
                rows for rows, keys in self.kept() if (_comment_of(rows[0]), keys) == (asked, said.students)
            ]
            if not same:
                raise RefusedError(409, "comment_changed")
            changed = [replace(row, comment=said.words, points=said.worth) for row in same[0]]
            self.check_points(changed[0])
            self._write(
                [(row, mark_of(was)) for row, was in zip(changed, same[0], strict=True)],
                there,
                said.window,
                said.by,
            )
            return self._marked_anew(set())

    def check_points(self, row: Decision) -> None:
        """Raise TableError where a row's points contradict its verdict or the rubric."""
        rubric = self.batch.rubric
        asked = next((one for one in rubric.criterion if one.id == row.criterion), None)
        why = None if asked is None else why_not(row, asked, rubric)
        if why is not None:
            raise TableError("decision_refused", row.criterion, [at(why, None, "points")])

    def refresh(self) -> None:
        """Take over what others wrote into the file in the meantime."""
        with self._lock:
            if stamp_of(self._file.path) != self._stamp:
                self._marked_anew(set())

    def _row(self, student: Student, criterion: str, verdict: str, by: str, there: Standing) -> Decision:
        batch = self.batch
        basis = basis_of(student.job.submission, batch.assignment, batch.rubric, criterion)
        return Decision(*there.key(student, criterion), verdict, None, "", by, _now(), basis)

    def _write(
        self,
        wanted: Sequence[tuple[Decision, str]],
        there: Standing,
        window: str,
        by: str,
        gone: Sequence[tuple[Decision, str]] = (),
    ) -> None:
        """Write rows, and take others out, each with the mark of what the person saw in its place."""
        for row, seen in (*wanted, *gone):
            standing = there.rows.get(row.key)
            if mark_of(standing) != seen:
                raise ChangedError(standing)
        rows, out = [row for row, _ in wanted], [there.rows[row.key] for row, _ in gone]
        if not rows and not out:
            return
        try:
            before = self._file.add(*rows, expected=there.rows.values()) if rows else []
            if out:
                self._file.remove(*out)
        except ClashError as error:
            raise ChangedError(error.rows[0] if error.rows else None) from error
        self._undo.setdefault(window, []).append(Change(tuple(rows), (*before, *out)))
        self.made += 1
        self._tell(by, rows, (*before, *out))

    def _tell(self, by: str, written: Sequence[Decision], before: Sequence[Decision]) -> None:
        """Note each decision, and the one before it or the program's own mark."""
        there, now = ({row.key: row for row in rows} for rows in (before, written))
        for key in {**there, **now}:
            about = " ".join(str(part) for part in key if part not in {"", None})
            self.note(by, about, _said(there.get(key)) or self._marked(key), _said(now.get(key)))

    def _marked(self, key: Key) -> str:
        """Return the program's own mark of a decision's subject."""
        for student in self.students:
            if key[0] == student.report.student_id and key[1] in {None, student.report.position}:
                return next((one.verdict for one in student.report.criteria if one.id == key[2]), "")
        return ""

    # Marks ----------------------------------------------------------------------------------------

    def _marked_anew(self, keys: Collection[str]) -> list[Student]:
        """Mark these students again, and those with changed rows; return them."""
        self._stamp = stamp_of(self._file.path)
        rows = self._file.all()
        changed = {row.student_id for row in {*rows} ^ {*self._rows}}
        self._rows = rows
        students = [one for one in self.students if one.key in keys or one.report.student_id in changed]
        self.version += 1
        for student in students:
            student.report = self._report(student, rows)
            student.version = self.version
        return students + self._opened_by_audit(rows)

    def _opened_by_audit(self, rows: Sequence[Decision]) -> list[Student]:
        """Mark the students again whose settled verdicts an audit opens, or no longer opens; return them."""
        if not any(row.kind == "audit" for row in rows) and not any(
            one.job.submission.opened for one in self.students
        ):
            return []
        trust = trust_of([student.report for student in self.students], self.batch.rubric.doubt.settle)
        found = []
        for student in self.students:
            likes = opened_in(student.report, trust)
            if likes != student.job.submission.opened:
                student.job = replace(student.job, submission=replace(student.job.submission, opened=likes))
                student.report = self._report(student, rows)
                student.version = self.version
                found.append(student)
        return found

    def _report(self, student: Student, rows: Sequence[Decision]) -> ReportDocument:
        """Return the report with the decisions of some rows of the file."""
        batch, report = self.batch, student.report
        own = [row for row in rows if row.kind == "page" or row.student_id == report.student_id]
        submission = decided(student.job.submission, own, batch.assignment, batch.rubric)
        return self._with_questions(student, submission)

    def _with_questions(self, student: Student, submission: StudentSubmission) -> ReportDocument:
        """Return the report; of an unreadable submission, as if a person had begun to settle it."""
        batch, pages = self.batch, self.pages_of(student)
        report, _ = mark(submission, pages, batch.assignment, batch.rubric, batch.level)
        if report.status != "unreadable" or report.criteria or submission.variant is None:
            return report
        first = batch.rubric.criterion[0].id
        begun = Decision(submission.student_id, submission.position, first, "not_judged")
        opened, _ = mark(
            replace(submission, decided=(*submission.decided, begun)),
            pages, batch.assignment, batch.rubric, batch.level,
        )  # fmt: skip
        asked = {"verdict": OPEN, "points": None, "decided": None, "probability": None}
        criteria = [
            one.model_copy(update=asked) if one.id == first and one.drawn else one for one in opened.criteria
        ]
        return opened.model_copy(update={"criteria": criteria})

    def sentence_if(self, student: Student, criterion: CriterionDocument) -> str:
        """Return the sentence that the student reads if the proposal is accepted."""
        if criterion.verdict != OPEN or criterion.proposed is None:
            return criterion.feedback
        after = {
            one.id: one for one in self.report_if(student, [(criterion.id, criterion.proposed)]).criteria
        }
        return after[criterion.id].feedback if criterion.id in after else criterion.feedback

    def report_if(
        self,
        student: Student,
        answers: Sequence[tuple[str, str] | tuple[str, str, float | None]],
        without: str = "",
    ) -> ReportDocument:
        """Return the report with these answers, verdicts or places by criterion, added to the decisions.

        Arguments: an answer may have points; `without` is a criterion whose decisions are left out.
        """
        with self._lock:
            report = student.report
            said = [Decision(report.student_id, report.position, *answer) for answer in answers]
            kept = [row for row in self._file.all() if row.criterion != without]
            return self._report(student, [*kept, *said])

    # Questions ------------------------------------------------------------------------------------

    def doubts(self, student: Student, *, until: float = math.inf) -> list[Doubt]:
        """Return the open questions on a student, in the order in which they are asked.

        The submission is judged with the likeliest answer to each, to see what it settles: to those that are
        reached by the time `until` (of `time.monotonic`).
        """
        if student.doubts is not None and student.doubts[0] == student.version:
            return student.doubts[1]
        variant = student.job.submission.variant
        if variant is None or all(one.verdict != OPEN for one in student.report.criteria):
            return []
        task = task_of(self.batch.assignment, self.batch.rubric, variant)
        found = doubts_of(task, student.report, figures_read(student.report, self.pages_of(student)))
        found = in_order([self._counted(student, one) if time.monotonic() < until else one for one in found])
        if time.monotonic() < until:
            student.doubts = student.version, found
        return found

    def _counted(self, student: Student, doubt: Doubt) -> Doubt:
        """Return a question with the number of verdicts that its likeliest answer settles."""
        likely = doubt.likeliest
        if likely is None:
            return doubt
        after = {one.id for one in self.report_if(student, likely.rows).criteria if one.verdict == OPEN}
        before = {one.id for one in student.report.criteria if one.verdict == OPEN}
        return replace(doubt, settles=len(before - after))

    def doubt(self, student: Student, name: str) -> Doubt | None:
        """Return an open question by its id; None if there is none."""
        found = (one for one in self.doubts(student, until=0.0) if one.id == name)
        return next((self._counted(student, one) for one in found), None)

    def snapped(self, key: str, sheet: int, figure: str, at: tuple[float, float]) -> tuple[float, float]:
        """Return the point of the ink that a place on a page means, both in sheet millimetres.

        Raises RefusedError for a page that there is not.
        """
        node = snapped(self.page(self.student(key), sheet).ink, *at, figure)
        return on_sheet(node.at)

    def page(self, student: Student, sheet: int) -> ScannedPage:
        """Return one of a student's pages as the last run read it. Raises RefusedError."""
        pages = self.pages_of(student)
        if not 0 <= sheet < len(pages):
            raise RefusedError(400, "page_missing", "no_page")
        return pages[sheet]

    # Pages ----------------------------------------------------------------------------------------

    def waiting_pages(self) -> list[tuple[PageRef, ProblemDocument]]:
        """Return the pages without an owner, then those that were refused, each with its problem."""
        if self.graded is None:
            return []
        found: dict[tuple[str, int], ProblemDocument] = {}
        for page in self.graded.results.unmatched:
            if page.page is not None:
                problem = ProblemDocument.model_validate(page.model_dump(exclude={"page"}))
                found.setdefault((page.file, page.page), problem)
        for student in self.students:
            for sheet in student.report.reading.sheets:
                if sheet.sheet is None and sheet.problems and sheet.problems[0].code not in NO_DRAWINGS:
                    found.setdefault((sheet.source, sheet.page), sheet.problems[0])
        refs = {(ref.file, ref.page): ref for ref in self.pages}
        return [(refs[place], problem) for place, problem in found.items() if place in refs]

    def owner_of(self, ref: PageRef, row: Decision | None) -> Student | None:
        """Return the owner of a page, by a decision or as found."""
        said = None if row is None else row.page.owner
        for student in self.students:
            report = student.report
            if said is not None and (report.student_id, report.position) == (said, row and row.position):
                return student
            own = {(page.file, page.page) for page in student.job.submission.pages}
            if said is None and (ref.file, ref.page) in own:
                return student
        return None

    # What is seen ---------------------------------------------------------------------------------

    def scene(self, student: Student, sheet: int) -> Scene | None:
        """Return the scene of the reading of one of a student's pages; None for a refused page."""
        construction = self._construction(student)
        page = self.pages_of(student)[sheet]
        if page.sheet is None or construction is None:
            return None
        reading = reading_of(student.report.reading.sheets[sheet])
        judged = {criterion.drawn: criterion for criterion in student.report.criteria if criterion.drawn}
        return scene_of(
            page.sheet.page_mm, reading, construction.vectors, judged,
            show_expected=False, links=construction.all_on_sketch,
        )  # fmt: skip

    def ghost(self, student: Student, sheet: int, criterion: CriterionDocument) -> Ghost | None:
        """Return the expected vector or link from the start of the drawn one; None if that is unread."""
        construction, figure = self._construction(student), self.figure_of(student, criterion)
        read = reading_of(student.report.reading.sheets[sheet]).figures.get(figure)
        expected = expected_vector(criterion)
        if construction is None or read is None or expected is None:
            return None
        vector = construction.vectors.get(criterion.drawn)
        tail = construction.all_on_sketch[criterion.drawn][0] if vector is None else vector.arrow[0]
        places = {name: node.at for name, node in read.nodes.items()} if not read.drawn else {}
        start = places.get(tail, read.drawn.get(criterion.drawn, (None,))[0])
        if start is None:
            return None
        at = on_sheet(start)
        return ghost_of(Arrow(criterion.drawn, figure, at, at, criterion.verdict, doubtful=False), expected)

    def nodes_of(self, student: Student, kind: str, document: FigureDocument) -> Iterator[Corner]:
        """Yield the nodes of a figure that a person may move; a force polygon's are called by its forces."""
        construction, figure = self._construction(student), figure_of(document)
        if construction is None:
            return
        corners = corners_of(construction, kind, figure) if group_of(kind) else {}
        for node, place in ends_on_sheet(construction, kind, figure).items():
            there = [name for name in figure.vectors if node in corners.get(name, ())]
            yield node, ", ".join(there) or node, on_sheet(place)

    def _construction(self, student: Student) -> Construction | None:
        variant = student.job.submission.variant
        if variant is None:
            return None
        return task_of(self.batch.assignment, self.batch.rubric, variant).construction

    def figure_of(self, student: Student, criterion: CriterionDocument) -> str:
        """Return the figure of a criterion's vector or link; empty for a scale or an angular quantity."""
        if criterion.link or criterion.on_sketch:
            return MECHANISM
        construction = self._construction(student)
        vector = construction.vectors.get(criterion.vector or "") if construction else None
        return construction.figure_of(vector.head) if construction and vector else ""


def _comment_of(row: Decision) -> tuple[str, str, float | None, str]:
    """Return what decisions have in common that use the same comment."""
    return row.criterion, row.verdict, row.points, row.comment


def _said(row: Decision | None) -> str:
    """Summarise what a row decides."""
    if row is None:
        return ""
    points = "" if row.points is None else f"{row.points:g}"
    return " ".join(filter(None, (row.verdict[:100], points))) or row.comment


def _now() -> str:
    return datetime.now().astimezone().isoformat(timespec="milliseconds")
