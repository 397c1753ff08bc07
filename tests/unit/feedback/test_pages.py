"""The pages: self-contained, safe, in the reader's language, and legible without colours."""

import re
from html.parser import HTMLParser

import pytest

from grader.documents import ProblemDocument, ReadingDocument, ReadSheets, SheetDocument
from grader.feedback import write_feedback, write_index
from grader.feedback.pages import feedback_page, folders_of, index_page
from grader.i18n import LANGUAGES
from grader.scene import MARKS
from tests.unit.feedback.works import HOSTILE, criterion, hostile_report, picture, report, results

VOID = {"meta", "input", "br", "img", "link"}


class Page(HTMLParser):
    """Tags that open and close, attributes, and the text outside style and script."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.words, self.ids = [], [], [], set()
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids |= {value for name, value in attrs if name == "id"}
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.ids |= {value for name, value in attrs if name == "id"}

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not self.open or self.open[-1] not in {"style", "script"}:
            self.words.append(data)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


def everything():
    return [
        feedback_page(report(), [picture(), picture("s07_2.jpg", spread=250.0)], "en"),
        feedback_page(
            hostile_report(), [picture(HOSTILE)], "ro", "hint", title=HOSTILE, student_name=HOSTILE
        ),
        feedback_page(report(criteria=[], mistakes=[], scales={}, status="missing", score=None), [], "ru"),
        index_page(results(report(), hostile_report()), "en", title=HOSTILE, student_names={"s08": HOSTILE}),
    ]


@pytest.mark.parametrize("text", everything())
def test_tags_are_closed_in_order_and_nothing_is_left_open(text):
    assert Page(text).open == []


@pytest.mark.parametrize("text", everything())
def test_nothing_is_fetched_from_elsewhere(text):
    for tag, attributes in Page(text).tags:
        for name in ("src", "href", "xlink:href", "action"):
            value = attributes.get(name) or ""
            assert not re.match(r"(?:[a-z]+:)?//", value), (tag, value)
    assert "url(" not in text
    assert "@import" not in text


@pytest.mark.parametrize("text", everything())
def test_what_students_write_is_never_run(text):
    assert "<script>alert" not in text
    assert text.count("<script") <= 1


def test_a_students_page_runs_no_script_at_all():
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', feedback_page(report(), [], "en"))
    assert "default-src 'none'" in policy[1]
    assert "script-src" not in policy[1]


@pytest.mark.parametrize("text", everything())
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
    text = text.replace("It is too long.", "").replace("pump", "").replace("x = 1", "").replace("s07", "")
    words = set(re.findall(r"[A-Za-z]{4,}", text))
    assert words == set()


def test_numbers_have_the_decimal_mark_of_the_language():
    assert "47,2" in feedback_page(report(), [], "ro")
    assert "47.2" in feedback_page(report(), [], "en")


def test_verdicts_are_marked_and_named_beside_their_colours():
    text = Page(feedback_page(report(), [], "en")).text
    for verdict, word in (("full", "right"), ("none", "wrong")):
        assert re.search(rf"{MARKS[verdict]} Vector .* {word}", text)


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
    assert text.count('href="#scan-1"') == 1


def test_a_plan_that_fills_the_sheet_has_no_close_up():
    assert "#scan-1" not in feedback_page(report(), [picture(spread=250.0)], "en")


def test_pictures_and_page_are_written_side_by_side(tmp_path):
    write_feedback(report(), [picture(), picture("s07_2.jpg")], tmp_path / "s07", "en")
    assert sorted(path.name for path in (tmp_path / "s07").iterdir()) == [
        "feedback.html", "overlay.png", "overlay_2.png",
    ]  # fmt: skip
    assert (tmp_path / "s07" / "overlay.png").read_bytes().startswith(b"\x89PNG")


def test_pictures_of_an_earlier_run_do_not_stay_behind(tmp_path):
    write_feedback(report(), [picture(), picture("s07_2.jpg")], tmp_path, "en")
    write_feedback(report(), [picture()], tmp_path, "en")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["feedback.html", "overlay.png"]


def test_instructors_are_told_how_a_sheet_was_placed_and_students_are_not():
    sheet = SheetDocument(
        method="markers", px_per_mm=11.8, rotation_deg=0.0, residual_mm=0.034, mm_to_px=[[1, 0, 0]] * 3
    )
    read = ReadingDocument(source="s07.jpg", page=1, student_id="s07", sheet=sheet, figures={})
    told = report(reading=ReadSheets(sheets=[read]))
    assert "placed by its markers, ±0.03\u00a0mm" in feedback_page(told, [picture()], "en")
    assert "placed by" not in feedback_page(told, [picture()], "en", "hint")


# The class ----------------------------------------------------------------------------------------


def test_the_index_links_every_report_where_it_is(tmp_path):
    reports = [
        report(), report(student_id="s08", position=1), report(student_id="s08", position=2),
        report(student_id="s08", position=None),
    ]  # fmt: skip
    write_index(results(*reports), tmp_path, "en")
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    for folder in ("s07", "s08/1", "s08/2", "s08/unknown"):
        assert f'href="{folder}/feedback.html"' in text
    assert folders_of(reports) == ["s07", "s08/1", "s08/2", "s08/unknown"]


def test_the_index_counts_states_and_lists_what_matches_nobody():
    text = Page(
        index_page(results(report(), report(student_id="s09", status="missing", score=None)), "en")
    ).text
    assert "1 ✓ graded" in text
    assert "1 – nothing handed in" in text
    assert HOSTILE in text


def test_the_index_names_the_hardest_criteria_and_commonest_mistakes():
    hard = report(criteria=[criterion("v_D", "none", 0.0), criterion("v_A", "full", 5.0)])
    text = Page(index_page(results(hard), "en")).text
    after = text.split("Hardest criteria")[1].split("Students")[0]
    assert "v D 0 %" in after
    assert "v A" not in after
    assert "Normal component reversed" in after


def test_the_same_problem_many_times_is_told_once_with_its_number():
    many = [ProblemDocument(code="measurement_fault", message=f"line {k}", file="m.csv") for k in range(9)]
    text = Page(index_page(results(report(problems=many)), "en")).text
    assert text.count("could not be used") == 1
    assert "×9" in text


def test_an_empty_class_has_a_page():
    assert Page(index_page(results(), "ru")).open == []
