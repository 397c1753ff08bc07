"""Data for the review page: a student's criteria as rows, and one question with all that it shows."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any
from urllib.parse import urlencode

from markupsafe import Markup

from grader.documents import CriterionDocument, Quantity
from grader.feedback.numbers import points_text, quantity_cells, score_text, tolerance_cells
from grader.feedback.sentences import feedback_again
from grader.feedback.words import VERDICTS, problem_sentence, unmatched_sentence
from grader.language import N_, Tongue, symbols
from grader.overlay.closeup import LEAST_LOOK_MM, LOOK_MARGIN_MM, box_around, look
from grader.overlay.scene import MARKS, ink_of
from grader.printed.layout import PAGE_MM, values_of
from grader.records import MECHANISM, Box, Reason, ScannedPage
from grader.review.doubts import SURE, known_probability
from grader.review.records import OPEN, Corner, Standing, Student, mark_of, page_criterion
from grader.review.session import Session
from grader.rubric import RubricFile
from grader.tables.decisions import Decision
from grader.texts.spoken import clause
from reference.drawing.canvas import elements
from reference.quantities import vector_of_value

Facts = dict[str, Any]
"""An object of JSON."""

SOMEBODY = N_("somebody")
TEXTS = {
    "left": N_("{open} open, about {minutes} min"),
    "nothing_left": N_("nothing is open"),
    "sheet": N_("sheet"),
    "node": N_("node"),
    "corner": N_("corner"),
    "no_scan": N_("It was entered by hand: there is no scan of it."),
    "no_place": N_(
        "Where the scale is written is not known: look at the title block, or at the whole sheet."
    ),
    "no_picture": N_("The picture could not be loaded: look at the sheet itself before you answer."),
    "wait": N_("The picture is not there yet."),
    "choose": N_("Enter does nothing here: no proposal is sure enough. Choose a verdict, 1 to 4."),
    "gone": N_("The server does not answer. What was accepted is kept; start planmark review again."),
    "look_again": N_("look again"),
    "close": N_("close"),
    "saved": N_("Saved."),
    "changed": N_("Somebody else has decided this in the meantime."),
    "nothing_to_undo": N_("Nothing was decided in this window."),
    "settles": N_("This settles {count}"),
    "accept_all": N_("Accept {count}"),
    "change_comment": N_("change for everybody: {text}"),
    "page_saved": N_("Saved. The page counts when the class is brought up to date."),
    "still_open": N_("Still open: {open}"),
    "all_settled": N_("Everything is settled."),
    "part_settled": N_("Your part is settled. Open in the rest of the class: {open}"),
    "part": N_("part {count} of {whole}"),
    "whole_class": N_("the whole class"),
    "somebody": SOMEBODY,
    "no_part": N_("The address names no part of this class, so you see all of it. Choose one under “share”."),
    "can_finish": N_(
        "You may export now: open submissions have no grade yet. Or continue with the open ones."
    ),
    "now_finish": N_("Update the marks and the pages now; any decision can still be changed afterwards."),
}
"""Texts of the script, which fills in the braces."""
CLASH = N_("%(who)s has decided this in the meantime: %(verdict)s. Yours was not written.")
TAKEN_BACK = N_("Somebody has taken this decision back in the meantime. Yours was not written.")
CHECKED = N_("decided by %(who)s")
SECOND = N_("%(who)s marked it a second time: %(verdict)s")
ASKED = N_("The student asks to look again: %(text)s")
STALE = N_("%(who)s decided: %(verdict)s; the submission or the criterion has changed since")
PROPOSED = N_("proposed: %(verdict)s")
ACCEPT = N_("Accept: %(verdict)s")
NO_PROPOSAL = N_("No proposal: choose a verdict")
GO_ON = N_("Go on")
UNSURE = N_("No default below %(least)s: choose")
FAULT = "decision_fault"
WHOLE_MARGIN = 0.03
"""Part of a figure's size that is shown around it."""


def texts(speaker: Tongue) -> Facts:
    """Return the texts of the script in a language."""
    return {
        **{name: speaker.gettext(text) for name, text in TEXTS.items()},
        "verdicts": {verdict: speaker.gettext(word) for verdict, word in VERDICTS.items()},
        "marks": dict(MARKS),
    }


# Rows ---------------------------------------------------------------------------------------------


def label_of(student: Student, speaker: Tongue) -> str:
    """Return a student's id, name and position."""
    report = student.report
    label = " ".join(part for part in (report.student_id, student.name) if part)
    if report.position is None:
        return label
    return f"{label} · {speaker.gettext('position')} {report.position}"


def student_facts(
    student: Student,
    standing: Standing,
    rubric: RubricFile,
    speaker: Tongue,
    questions: Sequence[Facts] = (),
) -> Facts:
    """Return a student and the rows of the criteria, to be ordered by the script."""
    report = student.report
    titles = {one.id: one.title.in_language(speaker.lang) for one in rubric.criterion}
    return {
        "key": student.key,
        "number": student.number,
        "place": student.place,
        "label": label_of(student, speaker),
        "score": f"{score_text(report, speaker)} / {points_text(report.max_score, speaker)}",
        "remark": report.comment,
        "added": report.added,
        "seen": [mark_of(standing.of(student, name)) for name in ("comment", "total")],
        "questions": list(questions),
        "rows": [
            _row(student, criterion, standing, titles[criterion.id], order)
            for order, criterion in enumerate(report.criteria)
        ],
    }


def _row(
    student: Student,
    criterion: CriterionDocument,
    standing: Standing,
    title: str,
    order: int = 0,
) -> Facts:
    row = standing.of(student, criterion.id)
    request = student.requests.get(criterion.id)
    return {
        "student": student.key,
        "criterion": criterion.id,
        "order": order,
        "title": whole_title(title, criterion.drawn),
        "verdict": criterion.verdict,
        "proposed": criterion.proposed,
        "probability": criterion.probability,
        "stake": criterion.max_points if criterion.verdict == OPEN else 0.0,
        "decided": row is not None and criterion.decided is not None,
        "by": row.by if row is not None else "",
        "asked": request is not None and not request.is_answered(row),
        "seen": mark_of(row),
    }


def whole_title(title: str, drawn: str) -> Markup:
    """Return a criterion's title, with the name of what was drawn if the title lacks it."""
    drawn = vector_of_value(drawn) or drawn
    return symbols(title if drawn in title else f"{title} {drawn}")


def kept_facts(session: Session, speaker: Tongue) -> Iterator[Facts]:
    """Yield the comments kept for reuse, the commonest first, each with the students who have it."""
    for rows, keys in session.kept():
        row, count = rows[0], len({*keys})
        points = "" if row.points is None else f" · {speaker.trimmed(row.points, 2)}"
        yield {
            "criterion": row.criterion, "verdict": row.verdict, "comment": row.comment, "points": row.points,
            "students": keys,
            "label": verdict_badge(row.verdict, row.comment + points),
            "changes": speaker.ngettext("Changes %d student", "Changes %d students", count) % count,
        }  # fmt: skip


def answer_facts(student: Student, name: str, verdict: str, seen: str) -> Facts:
    """Return the answer that a button posts."""
    return {"student": student.key, "criterion": name, "verdict": verdict, "seen": seen}


# One question -------------------------------------------------------------------------------------


def question_facts(session: Session, student: Student, name: str, speaker: Tongue) -> Facts:
    """Return one question on a student: what was handed in, what is right, the proposal, where to look."""
    criterion, standing = student.criterion(name), session.standing()
    title = next(one.title for one in session.batch.rubric.criterion if one.id == name)
    row = _row(student, criterion, standing, title.in_language(speaker.lang))
    decision, second = standing.of(student, name), standing.of(student, f"second:{name}")
    why = _why(session, student, criterion, asked=row["asked"], speaker=speaker)
    if second is not None:
        verdict = speaker.gettext(VERDICTS[second.audited[1].answer])
        why = Markup.escape(speaker.gettext(SECOND) % {"who": second.by, "verdict": verdict})
    is_known = criterion.verdict == OPEN and known_probability(criterion) is not None
    proposed = criterion.proposed if is_known else None
    what = speaker.gettext(VERDICTS[proposed]) if proposed else ""
    if proposed and criterion.probability is not None:
        what = f"{what}, {per_cent(criterion.probability)}"
    is_default = is_sure(criterion)
    said = speaker.gettext(PROPOSED) % {"verdict": what} if proposed else ""
    return {
        **row,
        "proposed": proposed if is_default else None,
        "decided": criterion.verdict if decision and criterion.decided else "",
        "comment": decision.comment if decision else "",
        "points": decision.points if decision else None,
        "most": speaker.trimmed(criterion.max_points, 2),
        "numbers": list(_numbers(criterion, speaker)),
        "state": state_of(criterion, decision, said, speaker),
        "brief": said or speaker.gettext(VERDICTS[criterion.verdict]),
        "accept": _accept(criterion, what, speaker),
        "why": why,
        "sentence": symbols(session.sentence_if(student, criterion))
        if is_default or criterion.verdict != OPEN
        else "",
        "look": look_of(session, student, criterion),
        "settles": "",
        "choices": _verdicts(student, criterion, row["seen"], decision, speaker),
    }


def _verdicts(
    student: Student, criterion: CriterionDocument, seen: str, decision: Decision | None, speaker: Tongue
) -> list[Facts]:
    """Return the buttons of a verdict, always in the same order."""
    is_decided = decision is not None and criterion.decided is not None
    return [
        {
            "key": str(number),
            "label": verdict_badge(verdict, speaker.gettext(VERDICTS[verdict])),
            "pressed": is_decided and criterion.verdict == verdict,
            "default": criterion.verdict == OPEN and is_sure(criterion) and criterion.proposed == verdict,
            "answers": [answer_facts(student, criterion.id, verdict, seen)],
        }
        for number, verdict in enumerate(("full", "partial", "none", "follow_through"), 1)
    ]


def badge(look: str, sign: str, words: str) -> Markup:
    """Return a sign in a circle, then words; `look` is a class of the style sheet."""
    return Markup('<span class="badge {}" aria-hidden="true">{}</span> {}').format(look, sign, words)


def verdict_badge(verdict: str, words: str) -> Markup:
    """Return a verdict's sign, then words."""
    return badge(f"v-{verdict}", MARKS[verdict], words)


def is_sure(criterion: CriterionDocument) -> bool:
    """Return whether a criterion's proposal is sure enough to be the default."""
    return criterion.proposed is not None and (criterion.probability or 0.0) >= SURE


def _accept(criterion: CriterionDocument, what: str, speaker: Tongue) -> Markup:
    """Return the words of the button that accepts the proposal, or why there is none."""
    if criterion.verdict != OPEN or is_sure(criterion):
        accept = ACCEPT if criterion.verdict == OPEN else GO_ON
        return Markup("<kbd>Enter</kbd> {}").format(speaker.gettext(accept) % {"verdict": what})
    if criterion.proposed is None or known_probability(criterion) is None:
        return Markup.escape(speaker.gettext(NO_PROPOSAL))
    return Markup.escape(speaker.gettext(UNSURE) % {"least": per_cent(SURE)})


def _why(
    session: Session, student: Student, criterion: CriterionDocument, *, asked: bool, speaker: Tongue
) -> Markup:
    """Return the reason why a person is asked: the doubt, or the student's request."""
    if asked:
        said = speaker.gettext(ASKED) % {"text": student.requests[criterion.id].text}
        return Markup.escape(said)
    return doubt_sentence(session, criterion, speaker) if criterion.verdict == OPEN else Markup()


def doubt_sentence(session: Session, criterion: CriterionDocument, speaker: Tongue) -> Markup:
    """Return the reason why a criterion waits, in the reviewer's language."""
    batch = session.batch
    return symbols(feedback_again(criterion, speaker.lang, batch.level, batch.assignment.names))


def per_cent(probability: float) -> str:
    """Return a probability as people read it: never rounded up to certainty."""
    return f"{int(100 * probability)}\N{NO-BREAK SPACE}%"


def state_of(criterion: CriterionDocument, decision: Decision | None, said: str, speaker: Tongue) -> Markup:
    """Return the verdict that stands, and who decided it or the proposal."""
    shown = verdict_badge(criterion.verdict, speaker.gettext(VERDICTS[criterion.verdict]))
    if criterion.decided is not None and criterion.verdict != OPEN:
        said = speaker.gettext(CHECKED) % {"who": criterion.decided.by or speaker.gettext(SOMEBODY)}
    elif criterion.decided is None and decision is not None:
        was = speaker.gettext(VERDICTS[decision.verdict])
        who = decision.by or speaker.gettext(SOMEBODY)
        said = speaker.gettext(STALE) % {"who": who, "verdict": was}
    return Markup('{} <span class="soft">{}</span>').format(shown, said) if said else shown


def _numbers(criterion: CriterionDocument, speaker: Tongue) -> Iterator[tuple[str, Markup]]:
    def cells(quantity: Quantity) -> str:
        return " · ".join(quantity_cells(quantity, speaker))

    unit = criterion.expected.unit or criterion.measured.unit or ""
    is_doubtful = criterion.verdict == OPEN and "doubtful" in criterion.reasons
    given = "–" if criterion.points is None else points_text(criterion.points, speaker)
    shown = (
        (N_("As read") if is_doubtful else N_("Measured"), cells(criterion.measured)),
        (N_("Expected"), cells(criterion.expected)),
        (N_("Tolerance"), " · ".join(tolerance_cells(criterion.tolerance, unit, speaker))),
        (N_("Points"), f"{given} / {points_text(criterion.max_points, speaker)}"),
    )
    return ((speaker.gettext(name), Markup.escape(value)) for name, value in shown if value)


# Where to look ------------------------------------------------------------------------------------


def look_of(session: Session, student: Student, criterion: CriterionDocument) -> Facts | None:
    """Return the part of a scan that a question is about, with the reading there; None without a scan."""
    names = session.batch.assignment.names
    pages, standing = session.pages_of(student), session.standing()
    first: Facts | None = None
    for sheet, page in enumerate(pages):
        scene = session.scene(student, sheet)
        if scene is None or page.sheet is None:
            continue
        ghost = session.ghost(student, sheet, criterion)
        seen = look(scene, criterion.drawn, ghost, names) if criterion.drawn else None
        figure = session.figure_of(student, criterion)
        read = student.report.reading.sheets[sheet].figures
        cells = _cells_box(session, page, criterion)
        box = cells or (seen[0] if seen else _box_of(read.get(figure), scene.page_mm))
        facts = {
            **sheet_facts(session, student, sheet),
            "page_mm": scene.page_mm,
            "box": box,
            "marks": seen[1] if seen else "",
            "nodes": [
                node
                for kind, one in read.items()
                if kind == figure or (figure == "" and kind != MECHANISM)
                for node in node_facts(student, standing, kind, session.nodes_of(student, kind, one))
            ],
        }
        if cells or seen or figure in read:
            return facts
        first = first or facts
    return first


def _cells_box(session: Session, page: ScannedPage, criterion: CriterionDocument) -> Box | None:
    """Return the part of a printed sheet around the cells for a computed value; None if it has none."""
    zones, batch = () if page.sheet is None else tuple(page.sheet.zones), session.batch
    name = criterion.value or (criterion.vector or "").removesuffix("_sense")
    place = values_of(batch.assignment, zones, batch.rubric.entries).get(name)
    if place is None or not (criterion.value or place.senses):
        return None
    ends = [at for x, y, wide, high in (place.box, *place.senses) for at in ((x, y), (x + wide, y + high))]
    return box_around(ends, LOOK_MARGIN_MM, LEAST_LOOK_MM, PAGE_MM)


def sheet_facts(session: Session, student: Student, sheet: int) -> Facts:
    """Return the address of a page's picture, to which the page adds the part that it wants, and its ink."""
    scan = "scan?" + urlencode({"student": student.key, "sheet": sheet, "run": session.runs})
    ink = "".join(elements(ink_of(row.stroke for row in session.ink(student, sheet))))
    return {"sheet": sheet, "scan": scan, "ink": ink}


def node_facts(student: Student, standing: Standing, kind: str, nodes: Iterable[Corner]) -> list[Facts]:
    """Return the nodes of a figure that a person may move."""
    return [
        {
            "figure": kind, "name": name, "label": label, "x": x, "y": y,
            "seen": mark_of(standing.of(student, f"node:{kind}:{name}")),
        }
        for name, label, (x, y) in nodes
    ]  # fmt: skip


def _box_of(figure: Any, page_mm: tuple[float, float]) -> Box:  # noqa: ANN401 - a figure's document, or None
    """Return a box around a figure's nodes, the whole page without nodes."""
    nodes = list(figure.nodes.values()) if figure else []
    if not nodes:
        return (0.0, 0.0, *page_mm)
    xs, ys = [node.x_mm for node in nodes], [node.y_mm for node in nodes]
    margin = 15.0 + WHOLE_MARGIN * (max(xs) - min(xs))
    return (
        min(xs) - margin, min(ys) - margin,
        max(xs) - min(xs) + 2 * margin, max(ys) - min(ys) + 2 * margin,
    )  # fmt: skip


# Pages --------------------------------------------------------------------------------------------


def pages_facts(session: Session, speaker: Tongue) -> Facts:
    """Return the pages without an owner or that were refused, and the students who may own them."""
    standing = session.standing()
    pages = []
    for ref, problem in session.waiting_pages():
        row = standing.rows.get(("", None, page_criterion(ref)))
        said = None if row is None else row.page
        try:
            width, height, turn = session.scans.format(ref)
        except Exception:  # noqa: BLE001 - a page that cannot be decoded can still be given to somebody
            width, height, turn = 0, 0, 0
        owner = session.owner_of(ref, row)
        pages.append(
            {
                "file": ref.file,
                "page": ref.page,
                "label": str(ref),
                "why": problem_sentence(problem, speaker).text,
                "said": row.verdict if row else "",
                "seen": mark_of(row),
                "owner": "" if owner is None else owner.key,
                "turn": said.turn if said and said.turn is not None else turn,
                "upright": turn,
                "corners": list(said.corners) if said else [],
                "width": width,
                "height": height,
                "picture": "page?" + urlencode({"file": ref.file, "page": ref.page}),
            }
        )
    owners = [{"key": student.key, "label": label_of(student, speaker)} for student in session.students]
    return {"pages": pages, "owners": owners, "idle": list(_idle(session, speaker))}


def _idle(session: Session, speaker: Tongue) -> Iterator[str]:
    """Yield the decisions that the last run could not apply, each with the reason."""
    results = None if session.graded is None else session.graded.results
    for one in [] if results is None else results.stale:
        what = speaker.gettext(VERDICTS[one.verdict]) if one.verdict in VERDICTS else one.verdict
        why = clause(Reason(one.code), speaker)
        yield f"{one.student_id} {one.criterion}: {what}. {why}".strip()
    for fault in [] if results is None else results.unmatched:
        if fault.code == FAULT:
            yield unmatched_sentence(fault, speaker).text
