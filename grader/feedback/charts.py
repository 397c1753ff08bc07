"""Drawings on the class's page, as SVG."""

from markupsafe import Markup

from grader.documents import ResultsDocument
from grader.feedback.statistics import BINS, histogram, open_shares, shares
from grader.i18n import Tongue

_STEP, _WIDE, _HIGH, _FOOT = 34, 28, 80.0, 100.0


def distribution_svg(results: ResultsDocument, speaker: Tongue) -> Markup:
    """The distribution of scores; empty where there are none.

    Final scores are full bars; what waits stands on top in dashes, at the middle of its range.
    """
    final, waiting = histogram(shares(results)), histogram(open_shares(results))
    tallest = max(a + b for a, b in zip(final, waiting, strict=True))
    if not tallest:
        return Markup("")
    parts = [_bar(index, final[index], waiting[index], tallest) for index in range(BINS)]
    parts.append(Markup('<text class="axis" x="343" y="115">100</text>'))
    summary = speaker.gettext("Scores in per cent of the maximum: how many students in each tenth.")
    return Markup(
        '<svg class="chart" viewBox="0 0 352 122" role="img" aria-label="{}">{}'
        '<line class="foot" x1="2" y1="100.5" x2="350" y2="100.5"/></svg>'
    ).format(summary, Markup("").join(parts))


def _bar(index: int, final: int, waiting: int, tallest: int) -> Markup:
    x, label = 6 + index * _STEP, f"{10 * index}–{10 * (index + 1)}"
    parts = []
    foot = _FOOT
    for count, kind in ((final, "final"), (waiting, "waits")):
        if count:
            height = _HIGH * count / tallest
            foot -= height
            place = Markup('x="{}" y="{:.1f}" width="{}" height="{:.1f}"').format(x, foot, _WIDE, height)
            told = f"{label} %: {count}"
            parts.append(Markup('<rect class="{}" {}><title>{}</title></rect>').format(kind, place, told))
    if final + waiting:
        parts.append(Markup('<text x="{}" y="{:.1f}">{}</text>').format(x + 14, foot - 5, final + waiting))
    parts.append(Markup('<text class="axis" x="{}" y="115">{}</text>').format(x - 3, 10 * index))
    return Markup("").join(parts)
