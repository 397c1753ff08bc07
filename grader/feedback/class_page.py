"""The page of a class, and the demo's page that links to its classes. Both work offline and on paper."""

import math
import shlex
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from urllib.parse import quote

from grader.documents import (
    Cause,
    CriterionDocument,
    MovedDocument,
    ReportDocument,
    ResultsDocument,
    Sign,
    StandingDocument,
    TrustDocument,
)
from grader.feedback.class_statistics import (
    commonest,
    follow_through,
    hardest,
    histogram,
    open_shares,
    settled,
    shares,
    spread,
    states,
    title_of,
    waiting,
    wrong_scales,
)
from grader.feedback.mistakes import MISTAKES
from grader.feedback.numbers import points_text
from grader.feedback.words import STATES, VERDICTS, environment, problem_sentence, unmatched_sentence
from grader.files import result_folders, write_whole
from grader.language import N_, NO_NAMES, Tongue, tongue
from grader.marking.trust import CONFIDENCE

# The page -----------------------------------------------------------------------------------------

SHOWN = 12
"""Number of students named at once; the others unfold."""
FEW = 3
"""Number of a student's changed criteria shown at once; more unfold together."""
SIGNS: Mapping[Sign, str] = {
    "hand_errors": N_("the same small errors of the hand"),
    "same_place": N_("figures lie in the same places on the sheet"),
    "same_numbers": N_("the same measured values"),
    "same_picture": N_("the ink lies in the same places"),
    "other_number": N_("drawn with the other's number"),
}
CAUSES: Mapping[Cause, str] = {
    "assignment": N_("the assignment was changed"),
    "rubric": N_("the rubric was changed"),
    "submission": N_("other files were handed in"),
    "roster": N_("the roster was changed"),
    "decision": N_("a person decided"),
    "program": N_("another version of the program"),
    "new": N_("new"),
    "gone": N_("no longer there"),
}


REVIEW = N_("Decide the open questions:")
EXPORT = N_("Export finished grades:")
WRONG = N_("Of %(settled)s verdicts that nobody has checked, about %(wrong)s may be wrong.")


AUDITED = N_(
    "%(right)s of %(audited)s verdicts checked at random were right: with %(confidence)s confidence at most"
    " %(share)s of the %(settled)s settled ones are wrong. This holds whenever you stop checking."
)
UNDECIDABLE = N_("Verdicts that could not be checked count as wrong here: %(unclear)s.")
LEAST_SURE = N_(
    "Of %(count)s more among the least sure, %(right)s were right; these are not a random sample."
)
FOUND_WRONG = N_(
    "A settled verdict of %(student)s was wrong. Verdicts like it were opened for a person: %(count)s"
    " (%(criterion)s, %(verdict)s)."
)
RAISED = N_(
    "More settled verdicts are wrong than the rubric allows (%(allowed)s). In this class, verdicts of"
    " probability %(raised)s or less go to a person: %(count)s."
)
MOVED_POINTS = N_("Points of drawings that a person put elsewhere: %(count)s.")
SOURCES: Mapping[str, str] = {
    "printed": N_("printed sheets"),
    "plain": N_("plain paper"),
    "photo": N_("photos"),
    "entered": N_("entered values"),
}
KINDS: Mapping[str, str] = {"settled": N_("settled, then checked"), "proposed": N_("proposed, then decided")}


def index_page(
    results: ResultsDocument,
    lang: str,
    *,
    title: str = "",
    student_names: Mapping[str, str] = NO_NAMES,
    out: str = "OUT",
    addresses: Sequence[str] = (),
) -> str:
    """Return the page of the class at a glance.

    Arguments
    ---------
    student_names : by student_id
    out : the folder of the results, as commands name it
    addresses : of the review and of the export, on a server, in the place of commands
    """
    speaker = tongue(lang)
    links = _links(results.reports)
    followed = follow_through(results)

    def link(student: ReportDocument | MovedDocument) -> Link:
        return links.get((student.student_id, student.position), Link(student.student_id))

    return environment(speaker.lang).get_template("index.html").render(
        results=results,
        title=title or results.assignment,
        steps=_next_steps(results, out, addresses),
        how_sure=_how_sure(results, speaker),
        trust=list(trust_sentences(results, speaker)),
        reliability=list(_reliability(results, speaker)),
        rows=[_row(report, student_names, link(report), speaker) for report in results.reports],
        has_positions=any(report.position is not None for report in results.reports),
        has_n=any("n" in report.variant for report in results.reports),
        unmatched=[unmatched_sentence(page, speaker) for page in results.unmatched],
        states=states(results),
        bins=list(zip(histogram(shares(results)), histogram(open_shares(results)), strict=True)),
        spread=spread(results),
        has_open=bool(open_shares(results)),
        hardest=hardest(results),
        commonest=[
            (title, len(reports), [link(report) for report in reports])
            for title, reports in commonest(results)
        ],
        followed=followed,
        followers=[link(report) for report in followed.reports],
        waiting=[(link(waiting.report), waiting) for waiting in waiting(results)],
        scales=[
            (link(report), [_scale(results, criterion, speaker) for criterion in lost], refused)
            for report, lost, refused in wrong_scales(results)
        ],
        alike=[
            ([links.get(key, Link(key[0])) for key in zip(pair.students, pair.positions, strict=True)], pair)
            for pair in results.alike
        ],
        signs=SIGNS,
        moved=[(link(change), change) for change in results.moved],
        causes=CAUSES,
        times=Counter(cause for change in results.moved for cause in change.why).most_common(),
        standing=partial(_standing, speaker=speaker),
        title_of=lambda criterion: title_of(results, criterion),
        shown=SHOWN,
        few=FEW,
    )  # fmt: skip


def needs_review(results: ResultsDocument) -> bool:
    """Return whether there is anything that a person can decide."""
    return bool(results.unmatched or results.stale or waiting(results))


def _next_steps(
    results: ResultsDocument, out: str, addresses: Sequence[str] = ()
) -> list[tuple[str, str, str]]:
    """Return the next steps, each with its command, or its address."""
    folder = shlex.quote(out)
    commands = (f"planmark review {folder}", f"planmark export {folder} --to moodle")
    wanted = (needs_review(results), states(results)["graded"])
    steps = zip((REVIEW, EXPORT), commands, addresses or ("", ""), wanted, strict=True)
    return [(text, command, link) for text, command, link, is_wanted in steps if is_wanted]


def _how_sure(results: ResultsDocument, speaker: Tongue) -> str:
    """State how many verdicts may be wrong; empty if that is not known."""
    if results.expected_wrong is None:
        return ""
    known = {"settled": settled(results), "wrong": speaker.significant(results.expected_wrong, 1)}
    return speaker.gettext(WRONG) % known


def audit_sentence(trust: TrustDocument, speaker: Tongue) -> str:
    """State what the random sample shows about all settled verdicts; empty before any of it is checked."""
    if trust.at_most is None:
        return ""
    share = math.ceil(1000.0 * trust.at_most - 1e-9) / 1000.0
    told = speaker.gettext(AUDITED) % {
        "right": trust.right, "audited": trust.audited, "settled": trust.settled,
        "share": _per_cent(share, speaker), "confidence": _per_cent(CONFIDENCE, speaker),
    }  # fmt: skip
    if not trust.unclear:
        return told
    return f"{told} {speaker.gettext(UNDECIDABLE) % {'unclear': trust.unclear}}"


def trust_sentences(results: ResultsDocument, speaker: Tongue) -> Iterator[str]:
    """Yield what people's checks show about the other verdicts; nothing before the first check."""
    trust = results.trust
    if trust is None:
        return

    def said(text: str, **values: object) -> str:
        return speaker.gettext(text) % values

    if trust.at_most is not None:
        yield audit_sentence(trust, speaker)
    if trust.least_sure:
        yield said(LEAST_SURE, count=trust.least_sure, right=trust.least_sure_right)
    titles = {one.id: title_of(results, one) for report in results.reports for one in report.criteria}
    for one in trust.opened:
        like = one.like
        if like.criterion is None:
            allowed, raised = _per_cent(1.0 - trust.settle, speaker), _per_cent(like.most, speaker)
            yield said(RAISED, allowed=allowed, raised=raised, count=one.count)
        else:
            verdict = speaker.gettext(VERDICTS[like.verdict or "review"])
            cause = f", {speaker.gettext(MISTAKES[like.mistake].title)}" if like.mistake in MISTAKES else ""
            yield said(
                FOUND_WRONG,
                student=one.student_id, count=one.count,
                criterion=titles.get(like.criterion, like.criterion), verdict=verdict + cause,
            )  # fmt: skip
    if trust.moved:
        yield said(MOVED_POINTS, count=trust.moved)


def _reliability(results: ResultsDocument, speaker: Tongue) -> Iterator[tuple[str, str, str, str]]:
    """Yield rows of the reliability table: source, kind, stated probability, share found right."""
    for one in [] if results.trust is None else results.trust.reliability:
        found = f"{_per_cent(one.right / one.count, speaker)} ({one.right} / {one.count})"
        source, kind = (speaker.gettext(text) for text in (SOURCES[one.source], KINDS[one.kind]))
        yield source, kind, _per_cent(math.floor(1000.0 * one.said) / 1000.0, speaker), found


def _per_cent(share: float, speaker: Tongue) -> str:
    return f"{speaker.trimmed(100.0 * share, 1)}\N{NO-BREAK SPACE}%"


# The demo's page ----------------------------------------------------------------------------------


def write_demo_page(classes: Mapping[str, tuple[str, ResultsDocument]], out_dir: Path, lang: str) -> None:
    """Write `index.html` with links to the demo's classes; `classes` by folder: title and results."""
    speaker = tongue(lang)
    page = (
        environment(speaker.lang)
        .get_template("demo.html")
        .render(
            classes=[
                (
                    title,
                    f"{quote(folder)}/index.html",
                    states(results),
                    _next_steps(results, f"{out_dir}/{folder}"),
                )
                for folder, (title, results) in classes.items()
            ]
        )
    )
    write_whole(out_dir / "index.html", page)


# Students -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Link:
    """A student's name as a link; `page` is empty for one who is gone, `picture` if there is no scan."""

    text: str
    page: str = ""
    picture: str = ""


Links = Mapping[tuple[str, int | None], Link]
"""Links by student and position."""


def _links(reports: Sequence[ReportDocument]) -> Links:
    count = Counter(report.student_id for report in reports)
    links = {}
    for report, folder in zip(reports, result_folders(reports), strict=True):
        student, position = report.student_id, report.position
        text = f"{student}, {position}" if count[student] > 1 else student
        picture = f"{quote(folder)}/overlay.png" if report.reading.sheets else ""
        links[student, position] = Link(text, f"{quote(folder)}/feedback.html", picture)
    return links


def _row(report: ReportDocument, names: Mapping[str, str], link: Link, speaker: Tongue) -> dict[str, object]:
    return {
        "report": report,
        "name": names.get(report.student_id, ""),
        "link": link.page,
        "waiting": sum(criterion.verdict == "review" for criterion in report.criteria),
        "problems": Counter(problem_sentence(problem, speaker, brief=True) for problem in report.problems),
        "best": report.score if report.score is not None else (report.score_range or (-1.0, -1.0))[0],
    }


def _scale(results: ResultsDocument, criterion: CriterionDocument, speaker: Tongue) -> str:
    """A scale that was not right: the declared one, and the right one."""
    quantities = (criterion.measured, criterion.expected)
    values = [speaker.value(each.value, each.unit or "") for each in quantities if each.value is not None]
    return f"{title_of(results, criterion)}: {' ≠ '.join(values)}"


# Changes since the last run ----------------------------------------------------------------------


def change_lines(results: ResultsDocument, speaker: Tongue) -> Iterator[str]:
    """Yield a line for each mark that the last run changed: the student, before and now, and why."""
    for one in results.moved:
        who = one.student_id if one.position is None else f"{one.student_id}, {one.position}"
        now = " → ".join(_standing(each, speaker) for each in (one.before, one.after))
        why = ", ".join(speaker.gettext(CAUSES[cause]) for cause in one.why)
        yield f"{who}: {now}" + (f" ({why})" if why else "")


def _standing(standing: StandingDocument | None, speaker: Tongue) -> str:
    if standing is None:
        return "–"
    if standing.score is not None:
        return points_text(standing.score, speaker)
    if standing.status == "needs_review" and standing.score_range is not None:
        return "–".join(points_text(value, speaker) for value in dict.fromkeys(standing.score_range))
    return speaker.gettext(STATES[standing.status])
