"""Assign people's decisions to the submissions and pages that they concern.

What a decision was about stands in its `basis`, as digests. One whose basis has changed is stale: it is told
and not applied. One that cannot be applied at all is a fault with its line; the others are applied.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from grader.documents import ReportDocument, StaleDecisionDocument, UnmatchedDocument
from grader.folder.cache import digest_of
from grader.marking.decided import NOT_APPLIED, strokes_on, why_not
from grader.printed.layout import PAGE_MM
from grader.records import PageRef, Reason, Value
from grader.rubric import RubricFile, plans_asked
from grader.tables.decisions import FILE_NAME, Decision, read_table
from grader.tables.measurements import StudentSubmission
from grader.tables.reader import at, near, short
from grader.tables.roster import Roster, RosterRow
from grader.texts.spoken import ENGLISH, clause, unmatched_document
from reference.authored.assignment import Assignment, Variant
from reference.authored.bodies import Masses
from reference.plan import construction_for

_DIGITS = 8
"""Digits of each digest: two of a class are the same by chance once in 10^5 classes."""
PageKey = tuple[str, int]
"""File and page."""


def decisions_path(folder: Path) -> Path:
    """Return the path of the decisions: in the folder handed in, or beside a single file."""
    return (folder if folder.is_dir() else folder.parent) / FILE_NAME


# What a decision is about -------------------------------------------------------------------------


def basis_of(
    submission: StudentSubmission, assignment: Assignment, rubric: RubricFile, criterion: str
) -> str:
    """The digest of what a decision is about: what was handed in, for which variant, what was asked for.

    Arguments: `criterion` as in `Decision`, of any kind but a page's.

    Titles, points, tolerances and the student's name are no part of it.
    """
    return _basis([*_handed_in(submission, assignment), _asked(submission, rubric, criterion)])


def _handed_in(submission: StudentSubmission, assignment: Assignment) -> list[object]:
    """Return what all decisions on a submission are about: files, pixels, the task."""
    entered = submission.measured
    by_hand = None if entered is None else (entered.numbers, entered.scales, entered.further_scales)
    return [
        (sorted((page.digest, page.page) for page in submission.pages), by_hand),
        (sorted(page.content for page in submission.pages), by_hand),
        (_task(assignment, submission.variant), submission.declared),
    ]


def _asked(submission: StudentSubmission, rubric: RubricFile, criterion: str) -> object:
    """Return what a criterion asks for; for a node or ink, the turn and corners of the pages."""
    is_node, asked = (
        criterion.startswith(("node:", "ink:")),
        criterion.removeprefix("audit:").removeprefix("second:"),
    )
    placed = [(page.turn_deg, page.corners_px) for page in submission.pages] if is_node else []
    return [one.name for one in rubric.criterion if one.id == asked], placed


def page_basis(page: PageRef) -> str:
    """The digest of a page that a decision is about."""
    return _basis([(page.digest, page.page), page.content])


def _basis(parts: Iterable[object]) -> str:
    # A letter first, and points between: no spreadsheet takes it for a number.
    return "b" + ".".join(digest_of([part])[:_DIGITS] for part in parts)


def _task(assignment: Assignment, variant: Variant | None) -> object:
    """Return what determines a variant's right answer, without titles."""
    mechanism = assignment.mechanism_file.model_dump_json(exclude={"title"})
    if variant is None:
        return assignment.id, mechanism
    numbers = {**assignment.values([variant]), **assignment.scales([variant]).by_name}
    told = {name: f"{float(np.ravel(number)[0]):.9g}" for name, number in numbers.items()}
    if assignment.file.has_forces:
        mechanism += assignment.file.model_dump_json(include={*Masses.model_fields})
    return assignment.id, mechanism, assignment.file.plate_images, told


_CHANGED = ("handed_in_changed", "data_changed", "asked_changed")
"""Reasons for which a decision is stale, by the part of its basis that differs."""


def _why_stale(then: str, now: str) -> str | None:
    """Return why a decision is stale by its basis then and now; None if it is not."""
    before, after = then.split("."), now.split(".")
    if not then or then == now:
        return None
    if len(before) != len(after):
        return _CHANGED[0]
    # The same file, or the same pixels in another file, are the same page.
    same = [before[0] == after[0] or before[1] == after[1], *map(str.__eq__, before[2:], after[2:])]
    return next((why for why, is_same in zip(_CHANGED, same, strict=False) if not is_same), None)


# A class's ----------------------------------------------------------------------------------------


@dataclass(slots=True)
class ClassDecisions:
    """The decisions on a class, and what became of them so far.

    Attributes
    ----------
    file : its name
    rows : those that can be read
    faults : lines that cannot be read or applied
    stale : decisions whose basis has changed
    """

    file: str
    rows: Sequence[Decision] = ()
    faults: list[Reason] = field(default_factory=list)
    stale: list[StaleDecisionDocument] = field(default_factory=list)
    pages: dict[PageKey, Decision] = field(default_factory=dict)
    """The decision on each page, as far as it applies."""

    def problems(self) -> list[UnmatchedDocument]:
        """The faults, by their lines."""
        return [
            unmatched_document(Reason("decision_fault", {"why": one.code, **one.parameters}, self.file))
            for one in sorted(self.faults, key=lambda fault: int(str(fault.parameters["line"])))
        ]

    # Pages -----------------------------------------------------------------------------------

    def place(self, pages: Sequence[PageRef]) -> list[PageRef]:
        """The pages, turned and with corners as people decided; call it once, with all pages of the class."""
        rows = {(row.scan.file, row.scan.page or 1): row for row in self.rows if row.kind == "page"}
        there = {(page.file, page.page): page for page in pages}
        for key, row in rows.items():
            page = there.get(key)
            if page is None and row.basis:
                self._out_of_date(row, "page_gone")
            elif page is None:
                self._fault("page_not_there", row, "criterion", source=key[0], wanted=key[1])
            elif row.scan.page is None and page.pages > 1:
                self._fault("page_open", row, "criterion", source=page.file, pages=page.pages)
            elif (why := _why_stale(row.basis, page_basis(page))) is not None:
                self._out_of_date(row, why)
            else:
                self.pages[key] = row
        decided = [self.pages.get((page.file, page.page)) for page in pages]
        return [
            replace(page, turn_deg=row.page.turn, corners_px=row.page.corners) if row else page
            for page, row in zip(pages, decided, strict=True)
        ]

    def owners(self, roster: Roster | None) -> dict[PageKey, RosterRow]:
        """The owners that people gave to pages, each on the roster where there is one."""
        owners: dict[PageKey, RosterRow] = {}
        for key, row in self.pages.items():
            student = row.page.owner
            if student is None:
                continue
            if roster is None:
                owners[key] = RosterRow(student, position=row.position)
                continue
            listed = roster.rows_of(student)
            fitting = [one for one in listed if row.position is None or one.position in (None, row.position)]
            if len(fitting) == 1:
                owners[key] = fitting[0]
            elif listed:
                self._fault("position_open", row, "position", student=student, **_positions(listed))
            else:
                meant = near(student, roster.student_ids)
                self._fault("student_not_listed", row, "verdict", student=student, **meant)
        return owners

    # Submissions -----------------------------------------------------------------------------

    def give(
        self, students: Sequence[StudentSubmission], assignment: Assignment, rubric: RubricFile
    ) -> list[StudentSubmission]:
        """The submissions, each with what was decided of it and still applies."""
        check = _Check(assignment, rubric)
        found: list[tuple[int, Decision]] = []
        for row in self.rows:
            if row.kind == "page":
                continue
            index = self._submission(row, students)
            if index is not None:
                found.append((index, row))
        twice = Counter((index, row.criterion) for index, row in found)
        given: dict[int, list[Decision]] = {}
        with_basis = {index for index, row in found if row.basis}
        about = {index: _handed_in(students[index], assignment) for index in with_basis}
        for index, row in found:
            fault = check.fault_of(row)
            if twice[index, row.criterion] > 1:
                known = {"criterion": row.criterion, "student": row.student_id}
                fault = "position", Reason("decided_twice", known)
            if fault is not None:
                self.faults.append(at(fault[1], row.line, fault[0]))
                continue
            asked = _asked(students[index], rubric, row.criterion)
            why = _why_stale(row.basis, _basis([*about[index], asked])) if row.basis else None
            if (
                why is None
                and row.kind == "ink"
                and not any(strokes_on(page, [row]) for page in students[index].pages)
            ):
                why = "page_gone"
            if why is not None:
                self._out_of_date(row, why)
            else:
                given.setdefault(index, []).append(row)
        return [
            replace(student, decided=tuple(sorted(own, key=lambda row: row.criterion)))
            for index, student in enumerate(students)
            for own in [[*given.get(index, []), *self._of_pages(student)]]
        ]

    def _of_pages(self, student: StudentSubmission) -> list[Decision]:
        keys = [(page.file, page.page) for page in student.pages]
        return [self.pages[key] for key in keys if key in self.pages]

    def _submission(self, row: Decision, students: Sequence[StudentSubmission]) -> int | None:
        """The submission that a row is about; None with a fault where there is none."""
        own = [(index, one) for index, one in enumerate(students) if one.student_id == row.student_id]
        fitting = [index for index, one in own if row.position in (None, one.position) or one.variant is None]
        if len(fitting) == 1:
            return fitting[0]
        if own:
            known = _positions([one for _, one in own])
            self._fault("position_open", row, "position", student=row.student_id, **known)
        else:
            meant = near(row.student_id, [one.student_id for one in students])
            self._fault("student_nobody", row, "student_id", student=row.student_id, **meant)
        return None

    def note_failures(self, reports: Iterable[ReportDocument]) -> None:
        """Note the decisions that marking could not apply, which stand in the reports' problems."""
        lines = {(row.student_id, row.position, row.criterion): row for row in self.rows}
        for report in reports:
            for problem in report.problems:
                if problem.code != NOT_APPLIED:
                    continue
                criterion = str(problem.parameters["criterion"])
                keys = [(report.student_id, position, criterion) for position in (report.position, None)]
                row = next((lines[key] for key in keys if key in lines), None)
                if row is not None:
                    self._fault(str(problem.parameters["why"]), row, "criterion")

    # Both ------------------------------------------------------------------------------------

    def _fault(self, code: str, row: Decision, column: str, **known: Value) -> None:
        self.faults.append(at(Reason(code, known), row.line, column))

    def _out_of_date(self, row: Decision, code: str) -> None:
        """Note a decision to be made again; an audit's answer or a second mark just stops counting."""
        if row.kind in {"audit", "second"}:
            return
        said = short(row.verdict) if row.kind == "ink" else row.verdict
        self.stale.append(
            StaleDecisionDocument(
                line=row.line, student_id=row.student_id, position=row.position, criterion=row.criterion,
                verdict=said, by=row.by, at=row.at, comment=row.comment, code=code,
                reason=clause(Reason(code), ENGLISH),
            )
        )  # fmt: skip


def decided(
    submission: StudentSubmission, rows: Sequence[Decision], assignment: Assignment, rubric: RubricFile
) -> StudentSubmission:
    """One submission with those of some decisions that are about it and apply; the others are left out."""
    decisions = ClassDecisions("", rows)
    decisions.pages |= {(row.scan.file, row.scan.page or 1): row for row in rows if row.kind == "page"}
    return decisions.give([submission], assignment, rubric)[0]


def class_decisions(path: Path) -> ClassDecisions:
    """The decisions in a file, none where there is none. Raises TableError for a fault of all of it."""
    table = read_table(path)
    return ClassDecisions(path.name, table.rows, list(table.faults))


def _positions(rows: Sequence[RosterRow | StudentSubmission]) -> dict[str, Value]:
    positions = tuple(str(row.position) for row in rows if row.position is not None)
    return {"positions": positions} if positions else {}


@dataclass(frozen=True)
class _Check:
    """A check of decisions against an assignment and its rubric."""

    assignment: Assignment
    rubric: RubricFile

    @cached_property
    def nodes(self) -> Mapping[str, list[str]]:
        """The nodes of each figure, the same of all variants."""
        construction = construction_for(self.assignment, **plans_asked(self.assignment, self.rubric))
        return {figure: [step.node for step in steps] for figure, steps in construction.figures.items()}

    def fault_of(self, row: Decision) -> tuple[str, Reason] | None:
        """The column that is wrong, and why; None for a decision that fits."""
        if row.kind == "node":
            return self._node(row)
        if row.kind not in {"verdict", "audit", "second"}:
            return None
        criteria = {one.id: one for one in self.rubric.criterion}
        asked = row.criterion if row.kind == "verdict" else row.audited[0]
        if asked not in criteria:
            return "criterion", Reason("criterion_unknown", {"text": asked, **near(asked, criteria)})
        if row.kind != "verdict":
            return None
        why = why_not(row, criteria[row.criterion], self.rubric)
        return None if why is None else ("points", why)

    def _node(self, row: Decision) -> tuple[str, Reason] | None:
        figure, node = row.node
        if figure not in self.nodes:
            return "criterion", Reason("figure_unknown", {"text": figure, "names": tuple(self.nodes)})
        if node not in self.nodes[figure]:
            known: dict[str, Value] = {"text": node, "figure": figure, "names": tuple(self.nodes[figure])}
            return "criterion", Reason("node_unknown", known)
        (x, y), (wide, high) = row.place, PAGE_MM
        if not (0.0 <= x <= wide and 0.0 <= y <= high):
            return "verdict", Reason(
                "place_outside", {"text": row.verdict, "wide_mm": int(wide), "high_mm": int(high)}
            )
        return None
