"""From a report to what its student is told: the leaflet's parts."""

from collections.abc import Mapping, Sequence

from markupsafe import Markup

from grader.documents import CriterionDocument, ReportDocument, SheetDocument
from grader.feedback import quantities, words
from grader.feedback.actions import actions_of, waiting_looks, waiting_of
from grader.feedback.leaflet import About, Leaflet, Row, ScaleRow, Sheetful
from grader.feedback.looks import looks_at
from grader.feedback.problems import problem_sentence
from grader.feedback.sentences import Level
from grader.feedback.templating import told_score
from grader.i18n import N_, Tongue
from grader.scene import Picture

NUMBER, POSITION, PAGE = N_("number"), N_("position"), N_("page")
WIDENED = N_("widened")
AS_MEASURED = N_("drawn from the entered measurements")


def leaflet_of(
    report: ReportDocument, pictures: Sequence[Picture], speaker: Tongue, level: Level, about: About
) -> Leaflet:
    """The leaflet of a report; its criteria's and mistakes' `feedback` is shown as it stands.

    Arguments: `pictures` are those of the pages handed in, or of the plans as measured.
    """
    names = about.names
    return Leaflet(
        speaker=speaker,
        level=level,
        title=about.title or report.assignment,
        student=about.student_name,
        student_id=report.student_id,
        about=_about(report, speaker),
        status=report.status,
        score=told_score(report, speaker),
        most=speaker.trimmed(report.max_score, 2),
        tally=_tally(report),
        problems=tuple(problem_sentence(problem, speaker) for problem in report.problems),
        actions=actions_of(report, pictures, speaker, level, names),
        waiting=waiting_of(report, speaker, names),
        waiting_looks=waiting_looks(report, pictures, names),
        sheets=tuple(
            Sheetful(tuple(looks_at(picture, index, names)), _source(report, picture, speaker, level))
            for index, picture in enumerate(pictures)
        ),
        rows=tuple(
            _row(criterion, speaker, level, names)
            for criterion in report.criteria
            if not _is_left_out(criterion)
        ),
        not_required=tuple(
            _left_out(criterion, speaker, level, names)
            for criterion in report.criteria
            if _is_left_out(criterion)
        ),
        has_widened=level == "full" and any(one.tolerance.widened for one in report.criteria),
        scales=_scales(report, speaker, level, names),
        pictures=tuple(pictures),
    )


def _about(report: ReportDocument, speaker: Tongue) -> tuple[str, ...]:
    said = []
    if "n" in report.variant:
        said.append(f"{speaker.gettext(NUMBER)} {report.variant['n']}")
    if report.position is not None:
        said.append(f"{speaker.gettext(POSITION)} {report.position}")
    return tuple(said)


def _tally(report: ReportDocument) -> tuple[tuple[str, int], ...]:
    verdicts = [criterion.verdict for criterion in report.criteria]
    return tuple((verdict, verdicts.count(verdict)) for verdict in words.VERDICTS if verdict in verdicts)


# Criteria -----------------------------------------------------------------------------------------


def _row(criterion: CriterionDocument, speaker: Tongue, level: Level, names: Mapping[str, str]) -> Row:
    full = level == "full"
    named = criterion.drawn
    is_told = named and named not in criterion.title
    said = criterion.feedback if criterion.feedback != speaker.gettext(N_("Right.")) else ""
    return Row(
        vector=named,
        verdict=criterion.verdict,
        title=words.symbols(criterion.title),
        name=words.symbols(names.get(named, named)) if is_told else Markup(""),
        verdict_told=speaker.gettext(words.VERDICTS[criterion.verdict]),
        measured=tuple(quantities.told(criterion.measured, speaker)),
        expected=tuple(quantities.told(criterion.expected, speaker)) if full else (),
        # A tolerance in per cent of what is expected would give it away.
        tolerance=_tolerance(criterion, speaker) if full else (),
        points="–" if criterion.points is None else speaker.trimmed(criterion.points, 2),
        most=speaker.trimmed(criterion.max_points, 2),
        said=words.symbols(said),
    )


def _is_left_out(criterion: CriterionDocument) -> bool:
    """Whether it was not handed in and need not be."""
    return criterion.verdict == "not_judged" and criterion.reasons[:1] == ["optional"]


def _left_out(
    criterion: CriterionDocument, speaker: Tongue, level: Level, names: Mapping[str, str]
) -> Markup:
    named = criterion.drawn or criterion.id
    name = words.symbols(names.get(named, named))
    value = quantities.told(criterion.expected, speaker)[-1:] if level == "full" else []
    return Markup("{} ({})").format(name, *value) if value else name


def _tolerance(criterion: CriterionDocument, speaker: Tongue) -> tuple[str, ...]:
    unit = criterion.expected.unit or criterion.measured.unit or ""
    told = quantities.tolerance(criterion.tolerance, unit, speaker)
    return (*told, speaker.gettext(WIDENED)) if told and criterion.tolerance.widened else tuple(told)


def _scales(
    report: ReportDocument, speaker: Tongue, level: Level, names: Mapping[str, str]
) -> tuple[ScaleRow, ...]:
    """The scales; what was used without being declared is an answer."""
    return tuple(
        ScaleRow(
            name=words.symbols(names.get(name, name)),
            declared=quantities.scale(scale.declared, name, speaker),
            remarks=tuple(
                remark
                for remark in (
                    scale.text,
                    speaker.gettext(words.SOURCES[scale.source]) if scale.source else "",
                    scale.refused,
                )
                if remark
            ),
            used=quantities.scale(scale.used, name, speaker) if level == "full" else "",
            assumed=scale.assumed,
        )
        for name, scale in report.scales.items()
    )


# Pages --------------------------------------------------------------------------------------------


def _source(report: ReportDocument, picture: Picture, speaker: Tongue, level: Level) -> str:
    """Which page of which file it is, and for instructors how its millimetres were found."""
    if not picture.scan:
        return f"{picture.source}: {speaker.gettext(AS_MEASURED)}"
    told = f"{picture.source}, {speaker.gettext(PAGE)} {picture.page}"
    placed = {(one.source, one.page): one.sheet for one in report.reading.sheets if level == "full"}
    how = _placed(placed.get((picture.source, picture.page)), speaker)
    return f"{told} · {how}" if how else told


def _placed(sheet: SheetDocument | None, speaker: Tongue) -> str:
    if sheet is None or sheet.method not in words.METHODS:
        return ""
    method = speaker.gettext(words.METHODS[sheet.method])
    return f"{method}, ±{speaker.quantity(sheet.residual_mm, 2, 'mm')}"
