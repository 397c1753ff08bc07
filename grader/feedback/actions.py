"""What a student is to put right, and what a person must still look at."""

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet

from markupsafe import Markup

from grader.documents import CriterionDocument, MistakeDocument, ReportDocument
from grader.feedback import words
from grader.feedback.leaflet import Action, Waiting
from grader.feedback.looks import Look, detail
from grader.feedback.mistakes import MISTAKES, words_of
from grader.feedback.sentences import Level, place
from grader.i18n import N_, Tongue
from grader.scene import Picture

OTHERS = N_("Also off, without a single likely cause")
OTHERS_SAID = N_(
    "What is off is told below, beside each criterion. Begin with the first of them:"
    " others may follow from it."
)
OR = N_("or")
MOST_WAITING_DETAILS = 3

WAITING: dict[str, str] = {
    "entry_refused": N_("an entry that it rests on cannot be used"),
    "doubtful": N_("read with too little certainty"),
    "near_limit": N_("so near the limit of the tolerance that the scan cannot decide"),
    "hand_may_miss": N_("off by no more than a careful hand may be where lines meet at a small angle"),
    "unread": N_("not read on the sheet"),
    "not_measured": N_("nothing was handed in for it"),
    "readings_disagree": N_("the drawing and the entered measurement differ"),
    "written_disagrees": N_("the drawing and the length written on the sheet differ"),
    "scale_assumed": N_("no scale was declared, and the drawing follows another than the assignment's own"),
    "scale_off": N_("the declared scale does not fit the drawing"),
    "follows": N_("it hangs on what is still open"),
    "": N_("open"),
}
"""Why a person must look, by the code of the reason; the first of these that a criterion has counts."""


def actions_of(
    report: ReportDocument,
    pictures: Sequence[Picture],
    speaker: Tongue,
    level: Level,
    names: Mapping[str, str],
) -> tuple[Action, ...]:
    """The mistakes in the order of construction, then what is off without one."""
    if level == "symbol":
        return ()
    order = [criterion.id for criterion in report.criteria]

    def first(mistake: MistakeDocument) -> int:
        return min((order.index(one) for one in mistake.explains if one in order), default=-1)

    mistakes = sorted(report.mistakes, key=first)
    told = [
        _action(mistake, report, pictures, speaker, names) for mistake in mistakes if mistake.code in MISTAKES
    ]
    explained = {one for mistake in mistakes for one in mistake.explains}
    others = [
        one for one in report.criteria if one.verdict in {"none", "partial"} and one.id not in explained
    ]
    if others:
        told.append(
            Action(
                title=Markup.escape(speaker.gettext(OTHERS)),
                at=Markup(""),
                said=Markup.escape(speaker.gettext(OTHERS_SAID)),
                explains=tuple(words.symbols(one.title) for one in others),
                look=detail(pictures, _first_figure(others), names),
            )
        )
    return tuple(told)


def _first_figure(criteria: Sequence[CriterionDocument]) -> set[str]:
    """The vectors or links of the figure in which the first of them is."""
    drawn = [one for one in criteria if one.drawn]
    return {one.drawn for one in drawn if _kind(one) == _kind(drawn[0])}


def _kind(criterion: CriterionDocument) -> str:
    """``v`` or ``a`` by the plan in which a vector is; empty for a link."""
    return (criterion.vector or "")[:1]


def _action(
    mistake: MistakeDocument,
    report: ReportDocument,
    pictures: Sequence[Picture],
    speaker: Tongue,
    names: Mapping[str, str],
) -> Action:
    titles = {criterion.id: criterion.title for criterion in report.criteria}
    vectors = {criterion.id: criterion.drawn for criterion in report.criteria}
    off = {
        criterion.id for criterion in report.criteria if criterion.verdict in {"none", "partial", "review"}
    }
    concerned = {vectors[one] for one in mistake.explains if one in off}
    alternatives = [_title(mistake.code, mistake.at, mistake.detail, speaker)]
    for rival in mistake.rivals:
        title = _title(rival.code, rival.at, rival.detail, speaker)
        alternatives += [title] if title not in alternatives else []
    joined = f" {speaker.gettext(OR)} ".join(alternatives)
    return Action(
        title=Markup.escape(joined[:1].upper() + joined[1:]),
        at=words.symbols(place(mistake.at, speaker, names)),
        said=words.symbols(mistake.feedback),
        alternatives=tuple(words.symbols(rival.feedback) for rival in mistake.rivals if rival.feedback),
        redo=tuple(words.symbols(line) for line in mistake.redo),
        explains=tuple(words.symbols(titles.get(one, one)) for one in mistake.explains),
        look=detail(pictures, concerned, names),
    )


def _title(code: str, at: str, detail_told: str, speaker: Tongue) -> str:
    known = dict(part.split(" = ", 1) for part in detail_told.split(", ") if " = " in part)
    return speaker.gettext(words_of(code, at, known.get("line", "")).title)


# What waits ---------------------------------------------------------------------------------------


def waiting_of(report: ReportDocument, speaker: Tongue, names: Mapping[str, str]) -> tuple[Waiting, ...]:
    """What waits for a person, by the reason."""
    groups: dict[str, list[Markup]] = {}
    for criterion in report.criteria:
        if criterion.verdict == "review":
            why = next((code for code in WAITING if code in criterion.reasons), "")
            named = criterion.drawn or criterion.id
            groups.setdefault(why, []).append(words.symbols(names.get(named, named)))
    return tuple(Waiting(speaker.gettext(WAITING[why]), tuple(one)) for why, one in groups.items())


def waiting_looks(
    report: ReportDocument, pictures: Sequence[Picture], names: Mapping[str, str]
) -> tuple[Look, ...]:
    """A closer look at some of what waits, vectors that lie together in one."""
    open_ones = [one.drawn for one in report.criteria if one.verdict == "review" and one.drawn]
    found: list[Look] = []
    shown: set[str] = set()
    for name in open_ones:
        if name in shown or len(found) == MOST_WAITING_DETAILS:
            continue
        look = detail(pictures, _near(name, open_ones, pictures), names)
        if look is not None:
            found.append(look)
            shown |= set(look.names)
    return tuple(found)


def _near(name: str, open_ones: Sequence[str], pictures: Sequence[Picture]) -> AbstractSet[str]:
    """A vector and those that end or start where it ends."""
    for picture in pictures:
        arrows = {arrow.name: arrow for arrow in picture.scene.arrows}
        if name in arrows:
            tip = arrows[name].tip
            return {
                other
                for other in open_ones
                if other in arrows and tip in {arrows[other].tail, arrows[other].tip}
            } | {name}
    return {name}
