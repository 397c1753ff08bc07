"""The pages: self-contained, safe, in the reader's language, and legible without colours."""

import re

import pytest

from grader.documents import ProblemDocument, ReadingDocument, ReadSheets, SheetDocument
from grader.feedback.class_page import index_page
from grader.feedback.student_page import About, feedback_page, write_feedback
from grader.language import LANGUAGES
from grader.overlay.scene import MARKS
from tests.unit.feedback.parsed import Page
from tests.unit.feedback.works import HOSTILE, criterion, hostile_report, picture, report, results

EVERYTHING = [
    feedback_page(report(), [picture(), picture("s07_2.jpg", spread=250.0)], "en"),
    feedback_page(hostile_report(), [picture(HOSTILE)], "ro", "hint", About(HOSTILE, HOSTILE)),
    feedback_page(report(criteria=[], mistakes=[], scales={}, status="missing", score=None), [], "ru"),
    index_page(results(report(), hostile_report()), "en", title=HOSTILE, student_names={"s08": HOSTILE}),
]


@pytest.mark.parametrize("text", EVERYTHING)
def test_tags_are_closed_in_order_and_nothing_is_left_open(text):
    assert Page(text).open == []


@pytest.mark.parametrize("text", EVERYTHING)
def test_nothing_is_fetched_from_elsewhere(text):
    for tag, attributes in Page(text).tags:
        for name in ("src", "href", "xlink:href", "action"):
            value = attributes.get(name) or ""
            assert not re.match(r"(?:[a-z]+:)?//", value), (tag, value)
    assert "url(" not in text
    assert "@import" not in text


@pytest.mark.parametrize("text", EVERYTHING)
def test_what_students_write_is_never_run(text):
    assert "<script>alert" not in text
    assert text.count("<script") <= 1


def test_a_students_page_runs_no_script_at_all():
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', feedback_page(report(), [], "en"))
    assert "default-src 'none'" in policy[1]
    assert "script-src" not in policy[1]


@pytest.mark.parametrize("text", EVERYTHING)
def test_links_within_a_page_lead_somewhere(text):
    page = Page(text)
    for _tag, attributes in page.tags:
        target = attributes.get("href") or ""
        if target.startswith("#"):
            assert target[1:] in page.ids


@pytest.mark.parametrize("lang", LANGUAGES)
def test_a_page_says_its_language(lang):
    assert f'<html lang="{lang}">' in feedback_page(report(), [], lang)


def test_a_page_in_russian_has_no_english_words_of_the_program():
    text = Page(feedback_page(report(), [picture()], "ru")).text
    text = text.replace("s07.jpg", "").replace("Vector", "").replace("Right.", "")
    text = (
        re.sub(r"It is too long\.|The normal component.*They meet in b'\.", "", text)
        .replace("pump", "")
        .replace("x = 1", "")
        .replace("s07", "")
    )
    words = set(re.findall(r"[A-Za-z]{4,}", text))
    assert words == set()


def test_numbers_have_the_decimal_mark_of_the_language():
    assert "47,2" in feedback_page(report(), [], "ro")
    assert "47.2" in feedback_page(report(), [], "en")


def test_verdicts_are_marked_and_named_beside_their_colours():
    text = Page(feedback_page(report(), [], "en")).text
    assert re.search(rf"{MARKS['none']} Vector .* wrong", text)
    assert re.search(rf"{MARKS['full']} Right: 1 .* {MARKS['full']} Vector v B", text)


def test_what_was_expected_is_shown_at_the_full_level_only():
    assert "46.4" in feedback_page(report(), [], "en", "full")
    for level in ("hint", "symbol"):
        text = feedback_page(report(), [], "en", level)
        assert "46.4" not in text
        assert "13.5" not in text
        assert "1.670" not in text
        assert "x = 1" not in text


def test_the_symbol_level_says_no_cause():
    assert "centre of rotation" in feedback_page(report(), [], "en", "hint")
    assert "centre of rotation" not in feedback_page(report(), [], "en", "symbol")


def test_a_score_under_review_is_a_range_and_says_so():
    waiting = report(status="needs_review", score=None, score_range=(5.0, 7.5))
    text = Page(feedback_page(waiting, [], "ro")).text
    assert "5–7,5" in text
    assert "Punctajul devine final" in text


def test_a_missing_submission_has_no_score():
    text = Page(feedback_page(report(status="missing", score=None, score_range=None), [], "en")).text
    assert re.search(r"– / 10\b", text)


def test_names_of_vectors_have_indices():
    text = feedback_page(report(), [], "en")
    assert "<i>a</i><sub>BA</sub><sup>n</sup>" in text


def test_problems_are_told_in_the_readers_language_with_the_programs_words():
    problem = ProblemDocument(
        code="pdf_encrypted", message="a.pdf: the PDF asks for a password", file="a.pdf"
    )
    text = Page(feedback_page(report(problems=[problem]), [], "ru")).text
    assert "PDF требует пароль" in text
    assert "a.pdf" in text


def test_the_scan_is_stored_once_however_often_it_is_shown():
    text = feedback_page(report(), [picture()], "en")
    assert text.count("data:image/jpeg") == 1
    assert text.count('id="scan-0"') == 1
    assert text.count('href="#scan-0"') >= 2


def test_a_plan_that_fills_the_sheet_has_no_close_up():
    whole = report(criteria=[criterion("v_A")], mistakes=[])
    assert feedback_page(whole, [picture()], "en").count("<figure") == 2
    assert feedback_page(whole, [picture(spread=250.0)], "en").count("<figure") == 1


def test_pictures_and_page_are_written_side_by_side(tmp_path):
    write_feedback("", [picture(), picture("s07_2.jpg")], tmp_path / "s07")
    assert sorted(path.name for path in (tmp_path / "s07").iterdir()) == [
        "feedback.html", "overlay.png", "overlay_2.png",
    ]  # fmt: skip
    assert (tmp_path / "s07" / "overlay.png").read_bytes().startswith(b"\x89PNG")


def test_pictures_of_an_earlier_run_do_not_stay_behind(tmp_path):
    write_feedback("", [picture(), picture("s07_2.jpg")], tmp_path)
    (tmp_path / "feedback.pdf").write_bytes(b"of a version that wrote it")
    write_feedback("", [picture()], tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["feedback.html", "overlay.png"]


def test_instructors_are_told_how_a_sheet_was_placed_and_students_are_not():
    sheet = SheetDocument(
        method="markers", px_per_mm=11.8, rotation_deg=0.0, residual_mm=0.034, mm_to_px=[[1, 0, 0]] * 3
    )
    read = ReadingDocument(source="s07.jpg", page=1, student_id="s07", sheet=sheet, figures={})
    told = report(reading=ReadSheets(sheets=[read]))
    assert "placed by its markers, ±0.03\u00a0mm" in feedback_page(told, [picture()], "en")
    assert "placed by" not in feedback_page(told, [picture()], "en", "hint")


@pytest.mark.parametrize("text", EVERYTHING)
def test_a_printed_page_is_a4_on_white_and_cuts_no_row_and_no_picture(text):
    printed = text.split("@media print {", 1)[1].split("</style>")[0]
    assert "@page { size: A4" in printed
    assert "body { background: #fff;" in printed
    kept_whole = re.search(r"([^{}]*)\{ break-inside: avoid; \}", printed)[1]
    assert {"tr", ".criteria tbody", "figure"} <= {name.strip() for name in kept_whole.split(",")}
