"""An A3 drawing scanned in two halves is refused, with what to do instead."""

from dataclasses import replace

import numpy as np
import pytest

from grader.printed.answer_sheet import make_sheets
from grader.records import Page, Sheet
from grader.scan.decode.pages import page_of
from grader.scan.register.registration import rectify
from grader.tables.roster import RosterRow
from reference.authored.assignment import load_assignment
from samples.simulation import any_settings, simulate
from tests.rendered import rendered

PUMP = load_assignment("pump")


def halves(page):
    """Left and right half of a page, each as a scanner for A4 sees it at 150 dpi."""
    high, wide = (round(side / 25.4 * 150.0) for side in (297.0, 210.0))
    parts = (page.grey[:high, :wide], page.grey[:high, -wide:])
    return [replace(page, grey=np.ascontiguousarray(part)) for part in parts]


def refused_as_half(page):
    sheet = rectify(page)
    return not isinstance(sheet, Sheet) and sheet.reason.parameters.get("advice") == "halves"


@pytest.mark.parametrize("dpi", [(150.0, 150.0), None])
def test_half_a_printed_sheet_is_refused_though_its_markers_are_seen(dpi):
    pdf = make_sheets(PUMP, [RosterRow("s07", "Ana", 7)]).pdf
    page = Page("s.png", 1, rendered(pdf, 150), dpi)
    assert isinstance(rectify(page), Sheet)
    assert all(refused_as_half(half) for half in halves(page))


@pytest.mark.parametrize("tagged", [True, False])
def test_half_a_plain_sheet_is_refused(tagged, tmp_path):
    settings = any_settings(12, device="flatbed", dpi=150.0, mistakes=0.0)
    scan = replace(settings.scan, dpi_tag=150.0 if tagged else None, quarter_turns=0)
    (drawn, *_) = simulate(PUMP, PUMP.variant(7), 12, replace(settings, scan=scan))
    page = page_of(drawn.save(tmp_path / "s01"), 1)
    assert isinstance(rectify(page), Sheet)
    assert all(refused_as_half(half) for half in halves(page))
