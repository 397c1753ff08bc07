"""What the page is told: a student's criteria as rows, and one question with all that is to be seen of it."""

import cmath
import math
from collections.abc import Iterator, Sequence
from typing import Any
from urllib.parse import urlencode

from markupsafe import Markup

from grader.documents import CriterionDocument, Quantity
from grader.feedback.numbers import quantity_cells, score_text, tolerance_cells
from grader.feedback.words import VERDICTS, problem_sentence, symbols, unmatched_sentence
from grader.inputs.decisions import Decision
from grader.language import N_, Tongue
from grader.overlay.closeup import LEAST_LOOK_MM, LOOK_MARGIN_MM, box_around, look
from grader.overlay.scene import MARKS
from grader.printed.layout import SCALE_BOXES, SCALE_OF
from grader.records import MECHANISM, Box
from grader.review.doubts import SURE, Choice, Doubt
from grader.review.session import OPEN, Session, Standing, Student, mark_of, page_criterion
from grader.rubric import RubricFile

Facts = dict[str, Any]
"""An object of JSON."""

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
    "page_saved": N_("Saved. The page counts when the class is brought up to date."),
    "still_open": N_("Still open: {open}"),
    "all_settled": N_("Everything is settled."),
    "can_finish": N_("You may export now; what is open has no grade yet. Or go on with what is open."),
    "now_finish": N_("Bring the pages up to date and export the grades; then look through the class's page."),
}
"""What the script says, in braces what it fills in itself."""
CLASH = N_("%(who)s has decided this in the meantime: %(verdict)s. Yours was not written.")
TAKEN_BACK = N_("Somebody has taken this decision back in the meantime. Yours was not written.")
SOMEBODY = N_("somebody")
CHECKED = N_("decided by %(who)s")
ASKED = N_("The student asks to look again: %(text)s")
STALE = N_("%(who)s decided: %(verdict)s; what that was about has changed since")
PROPOSED = N_("proposed: %(verdict)s")
ACCEPT = N_("Accept: %(verdict)s")
NO_PROPOSAL = N_("No proposal: choose a verdict")
GO_ON = N_("Go on")
UNSURE = N_("No default below %(least)s: choose")
WHOSE = N_("Whose data were drawn?")
WHICH = N_("Which stroke is meant: %(vectors)s?")
WHERE = N_("Is %(joint)s here? If it lies elsewhere, drag its ring.")
WHICH_SCALE = N_("Which scale was drawn with: %(scale)s?")
ARE_RIGHT = N_("Read in doubt: %(vectors)s")
NEITHER = N_("none of these: wrong")
PLACE = N_("stroke %(letter)s")
OF_OWNER = {
    "none": N_("another's: no points"),
    "follow": N_("their own: as proposed"),
}
OF_SCALE = {
    "full": N_("the declared one"),
    "partial": N_("nearly that one"),
    "none": N_("another: wrong"),
}
UNDECLARED = {
    "full": N_("the drawing's: right"),
    "none": N_("the drawing's: wrong"),
}
OF_GROUP = {"full": N_("all are right"), "none": N_("all are wrong")}
MOST_NAMED = 3
"""Vectors that a question names."""
FAULT = "decision_fault"
WHOLE_MARGIN = 0.03
"""Of a figure's size, where nothing else says what to look at."""


def texts(speaker: Tongue) -> Facts:
    """What the script says in a language."""
    return {
        **{name: speaker.gettext(text) for name, text in TEXTS.items()},
        "verdicts": {verdict: speaker.gettext(word) for verdict, word in VERDICTS.items()},
        "marks": dict(MARKS),
    }


# Rows ---------------------------------------------------------------------------------------------


def label_of(student: Student, speaker: Tongue) -> str:
    """What a student is called: id, name, position."""
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
    """A student and the rows of the criteria, to be ordered by the script."""
    report = student.report
    titles = {one.id: one.title.in_language(speaker.lang) for one in rubric.criterion}
    return {
        "key": student.key,
        "number": student.number,
        "label": label_of(student, speaker),
        "score": f"{score_text(report, speaker)} / {speaker.trimmed(report.max_score, 2)}",
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
    drawn = "" if criterion.drawn in title else criterion.drawn
    return {
        "student": student.key,
        "criterion": criterion.id,
        "order": order,
        "title": Markup("{} {}").format(symbols(title), symbols(drawn)) if drawn else symbols(title),
        "verdict": criterion.verdict,
        "proposed": criterion.proposed,
        "probability": criterion.probability,
        "stake": criterion.max_points if criterion.verdict == OPEN else 0.0,
        "decided": row is not None and criterion.decided is not None,
        "asked": request is not None and not request.is_answered(row),
        "seen": mark_of(row),
    }


def asked_facts(session: Session, student: Student, speaker: Tongue, *, counted: bool) -> list[Facts]:
    """The open questions on a student: what the script lists in the place of the rows that they cover."""
    standing = session.standing()
    rows = {one.id: one for one in student.report.criteria}
    return [
        {
            "student": student.key,
            "criterion": doubt.id,
            "kind": doubt.kind,
            "covers": doubt.criteria,
            "rank": rank,
            "settles": doubt.settles,
            "title": title_of(session, doubt, speaker),
            "verdict": OPEN,
            "probability": None if doubt.likeliest is None else doubt.likeliest.probability,
            "stake": sum(rows[name].max_points for name in doubt.criteria if name in rows),
            "decided": False,
            "asked": False,
            "seen": mark_of(standing.of(student, doubt.id)),
        }
        for rank, doubt in enumerate(session.doubts(student, counted=counted))
    ]


def title_of(session: Session, doubt: Doubt, speaker: Tongue) -> Markup:
    """What a question asks."""
    names = {one.id: one for one in session.batch.rubric.criterion}
    if doubt.kind == "owner":
        return Markup.escape(speaker.gettext(WHOSE))
    drawn = ", ".join(names[one].name for one in doubt.criteria[:MOST_NAMED] if one in names)
    more = ", …" if len(doubt.criteria) > MOST_NAMED else ""
    if doubt.kind == "node" and doubt.id.startswith(f"node:{MECHANISM}:"):
        return symbols(speaker.gettext(WHERE) % {"joint": doubt.id.split(":")[2]})
    if doubt.kind == "node":
        return symbols(speaker.gettext(WHICH) % {"vectors": drawn + more})
    if doubt.kind == "scale":
        return symbols(
            speaker.gettext(WHICH_SCALE) % {"scale": names[doubt.id].name if doubt.id in names else doubt.id}
        )
    if doubt.id in names:
        title = names[doubt.id].title.in_language(speaker.lang)
        drawn = "" if names[doubt.id].name in title else names[doubt.id].name
        return Markup("{} {}").format(symbols(title), symbols(drawn)) if drawn else symbols(title)
    return symbols(speaker.gettext(ARE_RIGHT) % {"vectors": drawn + more})


# One question -------------------------------------------------------------------------------------


def question_facts(session: Session, student: Student, name: str, speaker: Tongue) -> Facts:
    """One question on a student: what was handed in, what is right, what is proposed, where to look."""
    doubt = session.doubt(student, name)
    if doubt is not None and (
        doubt.kind != "verdict" or len(doubt.criteria) > 1 or doubt.id != doubt.criteria[0]
    ):
        return _doubt_facts(session, student, doubt, speaker)
    criterion, standing = student.criterion(name), session.standing()
    title = next(one.title for one in session.batch.rubric.criterion if one.id == name)
    row = _row(student, criterion, standing, title.in_language(speaker.lang))
    decision = standing.of(student, name)
    proposed = criterion.proposed if criterion.verdict == OPEN else None
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
        "position": "",
        "numbers": list(_numbers(criterion, speaker)),
        "state": _state(criterion, decision, said, speaker),
        "brief": said or speaker.gettext(VERDICTS[criterion.verdict]),
        "accept": _accept(criterion, what, speaker),
        "why": _why(student, criterion, asked=row["asked"], speaker=speaker),
        "sentence": symbols(session.sentence_if(student, criterion))
        if is_default or criterion.verdict != OPEN
        else "",
        "look": _look(session, student, criterion),
        "settles": _settles(doubt, speaker),
        "choices": _verdicts(student, criterion, row["seen"], decision, speaker),
    }


def _settles(doubt: Doubt | None, speaker: Tongue) -> str:
    """How many further verdicts an answer settles; empty where it is the one alone."""
    more = 0 if doubt is None else doubt.settles - 1
    return speaker.ngettext("settles %d more", "settles %d more", more) % more if more > 0 else ""


def _verdicts(
    student: Student, criterion: CriterionDocument, seen: str, decision: Decision | None, speaker: Tongue
) -> list[Facts]:
    """The buttons of a verdict, in an order that never changes."""
    is_decided = decision is not None and criterion.decided is not None
    return [
        {
            "key": str(number),
            "label": _badge(verdict, speaker.gettext(VERDICTS[verdict])),
            "pressed": is_decided and criterion.verdict == verdict,
            "default": criterion.verdict == OPEN and is_sure(criterion) and criterion.proposed == verdict,
            "answers": [
                {"student": student.key, "criterion": criterion.id, "verdict": verdict, "seen": seen}
            ],
        }
        for number, verdict in enumerate(("full", "partial", "none", "follow_through"), 1)
    ]


def _badge(verdict: str, words: str) -> Markup:
    return Markup('<span class="badge v-{}" aria-hidden="true">{}</span> {}').format(
        verdict, MARKS[verdict], words
    )


# A question on more than one verdict ---------------------------------------------------------------


def _doubt_facts(session: Session, student: Student, doubt: Doubt, speaker: Tongue) -> Facts:
    """A question whose answer is a place, a scale or whose drawing it is, or several verdicts at once."""
    standing, default = session.standing(), doubt.default
    first = student.criterion(doubt.criteria[0])
    choices = [
        _choice_facts(student, doubt, number, one, standing, speaker)
        for number, one in enumerate(doubt.choices, 1)
    ]
    label = "" if default is None else choices[doubt.choices.index(default)]["label"]
    sure = "" if default is None else f", {per_cent(default.probability or 0.0)}"
    accept = (
        Markup("<kbd>Enter</kbd> {}{}").format(label, sure)
        if default is not None
        else Markup.escape(speaker.gettext(UNSURE) % {"least": per_cent(SURE)})
    )
    after = (
        {} if default is None else {one.id: one for one in session.report_if(student, default.rows).criteria}
    )
    told = after[first.id].feedback if first.id in after and after[first.id].verdict != OPEN else ""
    return {
        "student": student.key,
        "criterion": doubt.id,
        "kind": doubt.kind,
        "title": title_of(session, doubt, speaker),
        "verdict": OPEN,
        "proposed": "" if default is None else default.key,
        "decided": "",
        "comment": "",
        "position": "",
        "seen": mark_of(standing.of(student, doubt.id)),
        "numbers": list(_doubt_numbers(student, doubt, first, speaker)),
        "state": _state(first, None, "", speaker),
        "brief": "",
        "accept": accept,
        "why": symbols(first.feedback) if doubt.kind != "node" else Markup(),
        "sentence": symbols(told),
        "settles": _settles(doubt, speaker),
        "look": _doubt_look(session, student, doubt, first),
        "choices": choices,
    }


def _choice_facts(
    student: Student, doubt: Doubt, number: int, choice: Choice, standing: Standing, speaker: Tongue
) -> Facts:
    if choice.at is not None:
        label = _letter(choice.key, speaker.gettext(PLACE) % {"letter": choice.key.upper()})
    elif choice.key == "neither":
        label = _badge("none", speaker.gettext(NEITHER))
    else:
        is_own = any(name == doubt.id for name, _ in choice.rows)
        words = {"owner": OF_OWNER, "scale": OF_SCALE if is_own else UNDECLARED}.get(doubt.kind, OF_GROUP)
        badge = choice.key if choice.key in MARKS else "follow_through"
        label = _badge(badge, speaker.gettext(words.get(choice.key, VERDICTS.get(choice.key, ""))))
    return {
        "key": str(number),
        "label": label,
        "pressed": False,
        "default": choice is doubt.default,
        "answers": [
            {
                "student": student.key,
                "criterion": name,
                "verdict": verdict,
                "seen": mark_of(standing.of(student, name)),
            }
            for name, verdict in choice.rows
        ],
    }


def _letter(key: str, words: str) -> Markup:
    return Markup('<span class="badge place-{}" aria-hidden="true">{}</span> {}').format(
        key, key.upper(), words
    )


def _doubt_numbers(
    student: Student, doubt: Doubt, first: CriterionDocument, speaker: Tongue
) -> Iterator[tuple[str, Markup]]:
    """Of a place the vector to it, beside the one expected; of a scale what was declared and drawn with."""
    if doubt.kind == "node":
        for choice in doubt.choices:
            if choice.at is not None and choice.start is not None:
                along = complex(choice.at[0] - choice.start[0], choice.start[1] - choice.at[1])
                turn = math.degrees(cmath.phase(along)) % 360.0
                cells = quantity_cells(Quantity(length_mm=abs(along), direction_deg=turn), speaker)
                yield choice.key.upper(), Markup.escape(" · ".join(cells))
        expected = Quantity(length_mm=first.expected.length_mm, direction_deg=first.expected.direction_deg)
        yield speaker.gettext("Expected"), Markup.escape(" · ".join(quantity_cells(expected, speaker)))
    elif doubt.kind == "scale":
        for name, quantity in ((N_("Declared"), first.measured), (N_("Drawn with"), first.expected)):
            cells = quantity_cells(quantity, speaker)
            if cells:
                yield speaker.gettext(name), Markup.escape(" · ".join(cells))
    points = sum(one.max_points for one in student.report.criteria if one.id in doubt.criteria)
    yield speaker.gettext("Points"), Markup.escape(f"– / {speaker.trimmed(points, 2)}")


def is_sure(criterion: CriterionDocument) -> bool:
    """Whether what is proposed for a criterion is sure enough to be the default."""
    return criterion.proposed is not None and (criterion.probability or 0.0) >= SURE


def _accept(criterion: CriterionDocument, what: str, speaker: Tongue) -> Markup:
    """The words of the button that accepts the proposal, or why there is none."""
    if criterion.verdict != OPEN or is_sure(criterion):
        accept = ACCEPT if criterion.verdict == OPEN else GO_ON
        return Markup("<kbd>Enter</kbd> {}").format(speaker.gettext(accept) % {"verdict": what})
    if criterion.proposed is None:
        return Markup.escape(speaker.gettext(NO_PROPOSAL))
    return Markup.escape(speaker.gettext(UNSURE) % {"least": per_cent(SURE)})


def _why(student: Student, criterion: CriterionDocument, *, asked: bool, speaker: Tongue) -> Markup:
    """Why a person is asked: the doubt, or the student's request."""
    if asked:
        said = speaker.gettext(ASKED) % {"text": student.requests[criterion.id].text}
        return Markup.escape(said)
    return symbols(criterion.feedback) if criterion.verdict == OPEN else Markup()


def per_cent(probability: float) -> str:
    """A probability as people read it: never rounded up to certainty."""
    return f"{int(100 * probability)}\N{NO-BREAK SPACE}%"


def _state(criterion: CriterionDocument, decision: Decision | None, said: str, speaker: Tongue) -> Markup:
    badge = Markup('<span class="badge v-{}" aria-hidden="true">{}</span> {}').format(
        criterion.verdict, MARKS[criterion.verdict], speaker.gettext(VERDICTS[criterion.verdict])
    )
    if criterion.decided is not None and criterion.verdict != OPEN:
        said = speaker.gettext(CHECKED) % {"who": criterion.decided.by or speaker.gettext(SOMEBODY)}
    elif criterion.decided is None and decision is not None:
        was = speaker.gettext(VERDICTS[decision.verdict])
        who = decision.by or speaker.gettext(SOMEBODY)
        said = speaker.gettext(STALE) % {"who": who, "verdict": was}
    return Markup('{} <span class="soft">{}</span>').format(badge, said) if said else badge


def _numbers(criterion: CriterionDocument, speaker: Tongue) -> Iterator[tuple[str, Markup]]:
    def cells(quantity: Quantity) -> str:
        return " · ".join(quantity_cells(quantity, speaker))

    unit = criterion.expected.unit or criterion.measured.unit or ""
    is_doubtful = criterion.verdict == OPEN and "doubtful" in criterion.reasons
    shown = (
        (N_("As read") if is_doubtful else N_("Measured"), cells(criterion.measured)),
        (N_("Expected"), cells(criterion.expected)),
        (N_("Tolerance"), " · ".join(tolerance_cells(criterion.tolerance, unit, speaker))),
        (N_("Points"), _points(criterion, speaker)),
    )
    return ((speaker.gettext(name), Markup.escape(value)) for name, value in shown if value)


def _points(criterion: CriterionDocument, speaker: Tongue) -> str:
    given = "–" if criterion.points is None else speaker.trimmed(criterion.points, 2)
    return f"{given} / {speaker.trimmed(criterion.max_points, 2)}"


# Where to look ------------------------------------------------------------------------------------


def _look(session: Session, student: Student, criterion: CriterionDocument) -> Facts | None:
    """The part of a scan that a question is about, with what was read there; None without a scan."""
    names = session.batch.assignment.file.names
    pages, standing = session.pages_of(student), session.standing()

    def seen_of(figure: str, node: str) -> str:
        return mark_of(standing.of(student, f"node:{figure}:{node}"))

    first: Facts | None = None
    for sheet, page in enumerate(pages):
        scene = session.scene(student, sheet)
        if scene is None or page.sheet is None:
            continue
        ghost = session.ghost(student, sheet, criterion)
        seen = look(scene, criterion.drawn, ghost, names) if criterion.drawn else None
        figure = session.figure_of(student, criterion)
        read = student.report.reading.sheets[sheet].figures
        box = seen[0] if seen else _box_of(read.get(figure), scene.page_mm)  # type: ignore[call-overload]
        facts = {
            "sheet": sheet,
            "scan": "scan?" + urlencode({"student": student.key, "sheet": sheet, "run": session.runs}),
            "page_mm": scene.page_mm,
            "box": box,
            "marks": seen[1] if seen else "",
            "nodes": [
                {"figure": kind, "name": name, "x": node.x_mm, "y": node.y_mm, "seen": seen_of(kind, name)}
                for kind, one in read.items()
                if kind == figure or (figure == "" and kind != MECHANISM)
                for name, node in one.nodes.items()
            ],
        }
        if seen or figure in read:
            return facts
        first = first or facts
    return first


def _doubt_look(session: Session, student: Student, doubt: Doubt, first: CriterionDocument) -> Facts | None:
    """Where to look: both strokes of a place, the writing of a scale, else the first vector."""
    look = _look(session, student, first)
    if look is None:
        return None
    if doubt.kind == "owner":
        return {**look, "box": (0.0, 0.0, *look["page_mm"]), "marks": ""}
    if doubt.kind == "scale":
        return {**look, **_written_at(session, student, doubt, look)}
    places = [one for one in doubt.choices if one.at is not None]
    if not places:
        return look
    if doubt.id.startswith(f"node:{MECHANISM}:"):
        look = {**look, **_on_the_sketch(session, student)}
    known = [point for one in places for point in (one.at, one.start) if point is not None]
    box = box_around(known, LOOK_MARGIN_MM, LEAST_LOOK_MM, look["page_mm"])
    return {
        **look,
        "box": box,
        "marks": Markup("").join(_place_marks(one, box[2]) for one in reversed(places)),
    }


def _on_the_sketch(session: Session, student: Student) -> Facts:
    """The sheet with the sketch, and its joints; nothing where there is none."""
    standing = session.standing()
    for sheet, document in enumerate(student.report.reading.sheets):
        figure = document.figures.get(MECHANISM)
        if figure is not None:
            asked = {"student": student.key, "sheet": sheet, "run": session.runs}
            nodes = [
                {
                    "figure": MECHANISM,
                    "name": name,
                    "x": node.x_mm,
                    "y": node.y_mm,
                    "seen": mark_of(standing.of(student, f"node:{MECHANISM}:{name}")),
                }
                for name, node in figure.nodes.items()
            ]
            return {"sheet": sheet, "scan": "scan?" + urlencode(asked), "nodes": nodes}
    return {}


def _place_marks(choice: Choice, wide_mm: float) -> Markup:
    """A candidate stroke with its letter."""
    (x, y), (sx, sy) = choice.at or (0.0, 0.0), choice.start or choice.at or (0.0, 0.0)
    size = wide_mm / 100.0
    away = complex(x - sx, y - sy)
    away = away / abs(away) if away else 1.0
    beside = {"a": -1j, "b": 1j}.get(choice.key, 1.0 + 0j)
    lx, ly = (
        x + size * (2.2 * away + 2.6 * away * beside).real,
        y + size * (2.2 * away + 2.6 * away * beside).imag,
    )
    return Markup(
        '<g class="place place-{key}" style="--mm:{size:.3f}">'
        '<line x1="{sx:.2f}" y1="{sy:.2f}" x2="{x:.2f}" y2="{y:.2f}"/>'
        '<circle cx="{x:.2f}" cy="{y:.2f}" r="{r:.2f}"/>'
        '<text x="{lx:.2f}" y="{ly:.2f}">{letter}</text></g>'
    ).format(
        key=choice.key,
        size=size,
        sx=sx,
        sy=sy,
        x=x,
        y=y,
        r=0.9 * size,
        lx=lx,
        ly=ly,
        letter=choice.key.upper(),
    )


def _written_at(session: Session, student: Student, doubt: Doubt, look: Facts) -> Facts:
    """The box of a printed sheet that a scale is written in; the place of a caption is not known.

    Then the lower right quarter is shown, where title blocks are, and the page says so.
    """
    scale = next((one.name for one in session.batch.rubric.criterion if one.id == doubt.id), doubt.id[-2:])
    for sheet, page in enumerate(session.pages_of(student)):
        if page.sheet is not None and any(SCALE_OF.get(figure) == scale for figure in page.sheet.zones):
            x, y, wide, high = SCALE_BOXES[scale]
            margin = 0.25 * wide
            box = (x - margin, y - margin, wide + 2 * margin, high + 2 * margin)
            asked = {"student": student.key, "sheet": sheet, "run": session.runs}
            return {"sheet": sheet, "scan": "scan?" + urlencode(asked), "box": box, "marks": "", "nodes": []}
    wide, high = look["page_mm"]
    return {
        "box": (0.5 * wide, 0.6 * high, 0.5 * wide, 0.4 * high),
        "marks": "",
        "nodes": [],
        "note": "no_place",
    }


def _box_of(figure: Any, page_mm: tuple[float, float]) -> Box:  # noqa: ANN401 - a figure's document, or None
    """A box around a figure's nodes, the whole page without them."""
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
    """The pages that are nobody's or were refused, and those whom they may be given to."""
    standing = session.standing()
    pages = []
    for ref, problem in session.waiting_pages():
        row = standing.rows.get(("", None, page_criterion(ref)))
        said = None if row is None else row.page
        try:
            (width, height), turn = session.scans.size(ref), session.scans.turn(ref)
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
    """The decisions that the last run could not apply, each with the reason."""
    results = None if session.graded is None else session.graded.results
    for one in [] if results is None else results.stale:
        what = speaker.gettext(VERDICTS[one.verdict]) if one.verdict in VERDICTS else one.verdict
        yield f"{one.student_id} {one.criterion}: {what}. {speaker.gettext(one.reason)}".strip()
    for fault in [] if results is None else results.unmatched:
        if fault.code == FAULT:
            yield unmatched_sentence(fault, speaker).text
