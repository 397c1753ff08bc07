"""Problems in the reader's language."""

import re
from pathlib import Path

from grader.documents import ProblemDocument, UnmatchedDocument
from grader.feedback.words import problem_sentence, unmatched_sentence
from grader.language import tongue
from grader.texts.problems import PROBLEMS

DOCUMENT = Path(__file__).parents[3] / "docs" / "errors.md"

ABOUT = ("Problems of a page", "Problems of a submission", "Problems of a class", "Files that cannot be used")


def test_every_documented_problem_is_told_in_the_readers_language():
    text = DOCUMENT.read_text(encoding="utf-8")
    sections = text.split("\n## ")
    about = [s for s in sections if s.startswith(ABOUT)]
    lines = [line.split("|") for section in about for line in section.splitlines() if line.startswith("| `")]
    documented = {code for _, codes, *_ in lines for code in re.findall(r"`(\w+)`", codes)}
    assert len(documented) > 20
    assert documented - set(PROBLEMS) == set()
    assert [code for code in PROBLEMS if f"`{code}`" not in text] == []


def test_english_readers_get_the_programs_own_more_precise_words():
    told = problem_sentence(ProblemDocument(code="pdf_encrypted", message="a.pdf: page 3 asks"), tongue("en"))
    assert (told.text, told.detail) == ("a.pdf: page 3 asks", "")


def test_others_get_a_sentence_and_those_words_beside_it():
    asks = ProblemDocument(code="pdf_encrypted", message="page 3 asks", parameters={"detail": "page 3 asks"})
    told = problem_sentence(asks, tongue("ro"))
    assert told.text.startswith("PDF-ul cere o parolă")
    assert told.detail == "page 3 asks"


def test_an_unknown_problem_is_told_by_its_words():
    assert problem_sentence(ProblemDocument(code="new", message="odd"), tongue("ru")).text == "odd"
    assert problem_sentence(ProblemDocument(code="new", message=""), tongue("ru")).text == "new"


def test_an_unmatched_page_is_named_with_its_number():
    nobody = UnmatchedDocument(file="class.pdf", page=4, code="owner_unknown", message="nothing says")
    assert unmatched_sentence(nobody, tongue("ru")).file == "class.pdf, страница 4"
