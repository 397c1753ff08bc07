"""Pages of a class as a phone, a dark room and a printer show them."""

from io import BytesIO

import numpy as np
import pypdfium2
import pytest
from PIL import Image

from grader.language import tongue
from grader.solution.pages import html_page
from grader.solution.sentences import wording_of
from reference.authored.assignment import Variant
from reference.drawing.subject import Subject
from reference.plan import exact_plan
from tests.unit.review.conftest import PUMP

pytestmark = pytest.mark.slow

PHONE = {"width": 390, "height": 844}


@pytest.fixture
def phone(chromium):
    """Opens a page as a phone does; `scheme` is light or dark."""
    contexts = []

    def open_page(path, scheme="light"):
        contexts.append(chromium.new_context(viewport=PHONE, color_scheme=scheme))
        page = contexts[-1].new_page()
        page.goto(path.as_uri())
        return page

    yield open_page
    for context in contexts:
        context.close()


def height(page):
    return page.evaluate("document.documentElement.scrollHeight")


def test_no_page_is_cut_on_a_phone_and_students_pages_are_short(phone, class_of_30):
    pages = sorted((class_of_30 / "out").rglob("*.html"))
    assert len(pages) > 30
    page = phone(pages[0])
    for path in pages:
        page.goto(path.as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"], path
        if path.name == "feedback.html":
            assert height(page) < 4 * PHONE["height"], path


def test_score_and_first_mistake_are_on_the_first_screen(phone, class_of_30):
    page = phone(class_of_30 / "out" / "s02" / "feedback.html")
    score, mistake = page.locator(".score").bounding_box(), page.locator("h3").first.bounding_box()
    assert score["y"] < mistake["y"] < PHONE["height"] / 2


def test_a_dark_room_has_dark_pages(phone, class_of_30):
    page = phone(class_of_30 / "out" / "index.html", "dark")
    red, green, blue = page.evaluate(
        "getComputedStyle(document.body).backgroundColor.match(/\\d+/g).slice(0, 3).map(Number)"
    )
    assert max(red, green, blue) < 60


def test_an_equation_has_a_shadow_at_the_edge_behind_which_it_goes_on(phone, tmp_path):
    plan, speaker = exact_plan(PUMP, [Variant(n=7)]), tongue("en")
    (tmp_path / "steps.html").write_text(html_page(Subject(PUMP, plan, 0, wording_of(speaker)), speaker))
    page = phone(tmp_path / "steps.html")
    equations = page.locator(".equation").element_handles()
    long = next(one for one in equations if one.evaluate("one => one.scrollWidth - one.clientWidth") > 40)

    def edges():
        """The lightest points of both edges: a letter is not as high as a shadow."""
        grey = np.asarray(Image.open(BytesIO(long.screenshot())).convert("L"))
        return grey[5:-5, 0].max() < 250, grey[5:-5, -1].max() < 250

    assert edges() == (False, True)
    long.evaluate("one => { one.scrollLeft = one.scrollWidth }")
    assert edges() == (True, False)


def test_what_is_folded_is_printed(phone, class_of_30, tmp_path):
    page = phone(class_of_30 / "out" / "s02" / "feedback.html")
    assert not page.locator("text=Velocity of A").first.is_visible()
    page.pdf(path=tmp_path / "page.pdf", format="A4", prefer_css_page_size=True)
    document = pypdfium2.PdfDocument(tmp_path / "page.pdf")
    text = "".join(sheet.get_textpage().get_text_range() for sheet in document)
    document.close()
    assert "Velocity of A" in text
