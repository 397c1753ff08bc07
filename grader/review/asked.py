"""Open questions as the page gets them: their list, and one question with its choices."""

import cmath
from collections.abc import Iterator, Mapping

from markupsafe import Markup

from grader.documents import CriterionDocument, Quantity
from grader.feedback.numbers import points_text, quantity_cells
from grader.feedback.words import VERDICTS
from grader.language import N_, Tongue, symbols
from grader.overlay.closeup import LEAST_LOOK_MM, LOOK_MARGIN_MM, box_around
from grader.overlay.scene import MARKS
from grader.printed.layout import SCALE_BOXES
from grader.records import MECHANISM
from grader.review.doubts import SURE, Choice, Doubt
from grader.review.questions import (
    UNSURE,
    Facts,
    answer_facts,
    badge,
    doubt_sentence,
    look_of,
    node_facts,
    per_cent,
    question_facts,
    sheet_facts,
    state_of,
    verdict_badge,
    whole_title,
)
from grader.review.records import OPEN, Standing, Student, mark_of
from grader.review.session import Session
from reference.geometry import degrees
from reference.quantities import scale_of

WHOSE = N_("Whose data were drawn?")
WHICH = N_("Which stroke is meant: %(vectors)s?")
WHERE = N_("Is %(joint)s here? If it lies elsewhere, drag its ring.")
WHICH_SCALE = N_("Which scale does the drawing use: %(scale)s?")
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


def asked_question(session: Session, student: Student, name: str, speaker: Tongue) -> Facts:
    """Return one question on a student: an open one by its id, or a criterion."""
    doubt = session.doubt(student, name)
    if doubt is not None and (doubt.kind != "verdict" or doubt.id not in doubt.criteria):
        return _doubt_facts(session, student, doubt, speaker)
    return {**question_facts(session, student, name, speaker), "settles": _settles(doubt, speaker)}


def asked_facts(session: Session, student: Student, speaker: Tongue, *, until: float) -> list[Facts]:
    """Return the open questions on a student, which replace the rows that they cover."""
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
        for rank, doubt in enumerate(session.doubts(student, until=until))
    ]


def title_of(session: Session, doubt: Doubt, speaker: Tongue) -> Markup:
    """Return the title of a question."""
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
        return whole_title(names[doubt.id].title.in_language(speaker.lang), names[doubt.id].name)
    return symbols(speaker.gettext(ARE_RIGHT) % {"vectors": drawn + more})


def _settles(doubt: Doubt | None, speaker: Tongue) -> str:
    """Say how many further verdicts an answer settles; empty if it settles one alone."""
    more = 0 if doubt is None else doubt.settles - 1
    return speaker.ngettext("settles %d more", "settles %d more", more) % more if more > 0 else ""


# A question on more than one verdict ---------------------------------------------------------------


def _doubt_facts(session: Session, student: Student, doubt: Doubt, speaker: Tongue) -> Facts:
    """Return a question about a place, a scale, an owner, or several verdicts at once."""
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
        "seen": mark_of(standing.of(student, doubt.id)),
        "numbers": list(_doubt_numbers(student, doubt, after, speaker)),
        "state": state_of(first, None, "", speaker),
        "brief": "",
        "accept": accept,
        "why": doubt_sentence(session, first, speaker) if doubt.kind != "node" else Markup(),
        "sentence": symbols(told),
        "settles": _settles(doubt, speaker),
        "look": _doubt_look(session, student, doubt, first),
        "choices": choices,
    }


def _choice_facts(
    student: Student, doubt: Doubt, number: int, choice: Choice, standing: Standing, speaker: Tongue
) -> Facts:
    if choice.at is not None:
        letter = choice.key.upper()
        label = badge(f"place-{choice.key}", letter, speaker.gettext(PLACE) % {"letter": letter})
    elif choice.key == "neither":
        label = verdict_badge("none", speaker.gettext(NEITHER))
    else:
        is_own = any(name == doubt.id for name, _ in choice.rows)
        words = {"owner": OF_OWNER, "scale": OF_SCALE if is_own else UNDECLARED}.get(doubt.kind, OF_GROUP)
        mark = choice.key if choice.key in MARKS else "follow_through"
        label = verdict_badge(mark, speaker.gettext(words.get(choice.key, VERDICTS.get(choice.key, ""))))
    return {
        "key": str(number),
        "label": label,
        "pressed": False,
        "default": choice is doubt.default,
        "answers": [
            answer_facts(student, name, verdict, mark_of(standing.of(student, name)))
            for name, verdict in choice.rows
        ],
    }


def _doubt_numbers(
    student: Student, doubt: Doubt, after: Mapping[str, CriterionDocument], speaker: Tongue
) -> Iterator[tuple[str, Markup]]:
    """List the vector of each place beside the expected one, or the declared scale beside the drawn one.

    Arguments: `after` are the criteria as judged with the likeliest answer; empty where none is offered.
    """
    first = student.criterion(doubt.criteria[0])
    if doubt.kind == "node":
        for choice in doubt.choices:
            along = choice.along
            if along is not None:
                turn = degrees(cmath.phase(along))
                cells = quantity_cells(Quantity(length_mm=abs(along), direction_deg=turn), speaker)
                yield choice.key.upper(), Markup.escape(" · ".join(cells))
        of_stroke = next((one.vector for one in doubt.choices if one.vector), first.vector)
        rows = after.values() or student.report.criteria
        shown = next((one for one in rows if one.vector == of_stroke), first).expected
        expected = Quantity(length_mm=shown.length_mm, direction_deg=shown.direction_deg)
        yield speaker.gettext("Expected"), Markup.escape(" · ".join(quantity_cells(expected, speaker)))
    elif doubt.kind == "scale":
        for name, quantity in ((N_("Declared"), first.measured), (N_("Drawn with"), first.expected)):
            cells = quantity_cells(quantity, speaker)
            if cells:
                yield speaker.gettext(name), Markup.escape(" · ".join(cells))
    points = sum(one.max_points for one in student.report.criteria if one.id in doubt.criteria)
    yield speaker.gettext("Points"), Markup.escape(f"– / {points_text(points, speaker)}")


def _doubt_look(session: Session, student: Student, doubt: Doubt, first: CriterionDocument) -> Facts | None:
    """Return the part of a scan to show: the strokes of a place, the text of a scale, or the first vector."""
    look = look_of(session, student, first)
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
    """Return the sheet with the sketch, and its joints; nothing if there is none."""
    standing = session.standing()
    for sheet, document in enumerate(student.report.reading.sheets):
        figure = document.figures.get("mechanism")
        if figure is not None:
            nodes = node_facts(student, standing, MECHANISM, session.nodes_of(student, MECHANISM, figure))
            return {**sheet_facts(session, student, sheet), "nodes": nodes}
    return {}


def _place_marks(choice: Choice, wide_mm: float) -> Markup:
    """Return a candidate stroke with its letter."""
    (x, y), (sx, sy) = choice.at or (0.0, 0.0), choice.start or choice.at or (0.0, 0.0)
    size = wide_mm / 100.0
    away = complex(x - sx, y - sy)
    away = away / abs(away) if away else 1.0
    beside = {"a": -1j, "b": 1j}.get(choice.key, 1.0 + 0j)
    label = complex(x, y) + size * away * (2.2 + 2.6 * beside)
    # No style attributes: the page's policy refuses them.
    return Markup(
        '<g class="place place-{key}">'
        '<line x1="{sx:.2f}" y1="{sy:.2f}" x2="{x:.2f}" y2="{y:.2f}" stroke-width="{thin:.2f}"'
        ' stroke-dasharray="{dash:.2f} {gap:.2f}"/>'
        '<circle cx="{x:.2f}" cy="{y:.2f}" r="{r:.2f}" stroke-width="{thin:.2f}"/>'
        '<text x="{lx:.2f}" y="{ly:.2f}" font-size="{font:.2f}" stroke-width="{halo:.2f}">{letter}</text></g>'
    ).format(
        key=choice.key, letter=choice.key.upper(), sx=sx, sy=sy, x=x, y=y, lx=label.real, ly=label.imag,
        r=0.9 * size, thin=0.4 * size, dash=2.0 * size, gap=1.2 * size, font=4.0 * size, halo=0.8 * size,
    )  # fmt: skip


def _written_at(session: Session, student: Student, doubt: Doubt, look: Facts) -> Facts:
    """Return the box of a printed sheet for a scale; the place of a caption is not known.

    Then the lower right quarter is shown, where title blocks are, and the page says so.
    """
    scale = next((one.name for one in session.batch.rubric.criterion if one.id == doubt.id), doubt.id[-2:])
    for sheet, page in enumerate(session.pages_of(student)):
        if page.sheet is not None and scale in map(scale_of, page.sheet.zones):
            x, y, wide, high = SCALE_BOXES[scale]
            margin = 0.25 * wide
            box = (x - margin, y - margin, wide + 2 * margin, high + 2 * margin)
            return {**sheet_facts(session, student, sheet), "box": box, "marks": "", "nodes": []}
    wide, high = look["page_mm"]
    return {
        "box": (0.5 * wide, 0.6 * high, 0.5 * wide, 0.4 * high),
        "marks": "",
        "nodes": [],
        "note": "no_place",
    }
