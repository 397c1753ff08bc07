"""The printed leaflet: A4, the same words as the page for the screen, whatever stands in the report."""

import re

import pypdfium2
import pytest

from grader.documents import RivalDocument
from grader.feedback.leaflet import About
from grader.feedback.leaflets import leaflet_of
from grader.feedback.pages import page_of, write_feedback
from grader.feedback.printed import pdf_of
from grader.i18n import LANGUAGES, tongue
from tests.unit.feedback.test_pages import Page
from tests.unit.feedback.works import HOSTILE, criterion, hostile_report, picture, report

A4_POINTS = (595.3, 841.9)
POINT = 0.1


def leaflet(one=None, pictures=(), lang="en", level="full", about=None):
    return leaflet_of(one or report(), pictures, tongue(lang), level, about or About())


def text_of(pdf):
    document = pypdfium2.PdfDocument(pdf)
    return " ".join(page.get_textpage().get_text_range() for page in document)


def words_of(text):
    """Letters and digits alone: line ends and marks are set in different ways."""
    return re.sub(r"[\W_]+", "", text.replace("\ufffe", "").replace("\u00ad", ""))


def test_pages_are_a4():
    document = pypdfium2.PdfDocument(pdf_of(leaflet(pictures=[picture()])))
    for page in document:
        assert page.get_size() == pytest.approx(A4_POINTS, abs=POINT)


@pytest.mark.parametrize("lang", LANGUAGES)
def test_every_sentence_and_number_of_the_screen_is_printed_too(lang):
    told = leaflet(report(), [picture()], lang, about=About("Pompă / Насос", "Ștefan Жуков"))
    printed = words_of(text_of(pdf_of(told)))
    for row in told.rows:
        for part in (*row.measured, *row.expected, *row.tolerance, row.title.striptags(), row.verdict_told):
            assert words_of(part) in printed, part
    for action in told.actions:
        for part in (action.said, *action.redo):
            assert words_of(part.striptags()) in printed
    assert words_of(told.student) in printed
    assert words_of(told.footer) in printed


def test_hostile_texts_are_printed_as_they_stand():
    one = hostile_report()
    told = leaflet(one, [picture(HOSTILE)], about=About(HOSTILE, HOSTILE))
    assert HOSTILE in text_of(pdf_of(told))


def test_rivals_stand_in_the_page_and_in_print():
    rivals = [RivalDocument(code="wrong_link", at="b'", confidence=0.3, feedback="A line was turned.")]
    mistake = report().mistakes[0].model_copy(update={"rivals": rivals})
    told = leaflet(report(mistakes=[mistake]))
    assert told.actions[0].title == "Normal component reversed or line drawn by the wrong link"
    for text in (Page(page_of(told)).text, text_of(pdf_of(told))):
        assert "or: A line was turned." in " ".join(text.split())


def test_a_long_class_of_criteria_runs_over_several_pages_with_its_head_on_each():
    many = report(
        criteria=[criterion(f"v_{k}", "none", 0.0, feedback="It is too long. " * 9) for k in range(60)]
    )
    document = pypdfium2.PdfDocument(pdf_of(leaflet(many)))
    assert len(document) > 2
    for page in list(document)[1:-1]:
        assert "Measured" in page.get_textpage().get_text_range()


def test_nothing_handed_in_makes_one_short_page():
    missing = report(criteria=[], mistakes=[], scales={}, status="missing", score=None, score_range=None)
    document = pypdfium2.PdfDocument(pdf_of(leaflet(missing)))
    assert len(document) == 1


def test_the_same_leaflet_makes_the_same_bytes():
    told = leaflet(pictures=[picture()])
    assert pdf_of(told) == pdf_of(told)


def test_print_is_written_where_it_is_asked_for_and_goes_where_it_is_not(tmp_path):
    write_feedback(report(), [picture()], tmp_path, "en", with_pdf=True)
    assert (tmp_path / "feedback.pdf").read_bytes().startswith(b"%PDF")
    write_feedback(report(), [picture()], tmp_path, "en")
    assert not (tmp_path / "feedback.pdf").exists()
