import numpy as np
import pytest
import segno
from hypothesis import given
from hypothesis import strategies as st

from grader.printed.layout import code_of, identity_of
from grader.records import Identity, Page
from grader.scan.register.markers import identify

NAMES = st.from_regex(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,63}", fullmatch=True)
NUMBERS = st.none() | st.integers(-(10**9) + 1, 10**9 - 1)


def picture(*texts: str, quarter_turns: int = 0) -> Page:
    """A page with QR codes side by side."""
    codes = [
        np.kron(
            np.pad(1 - np.array(segno.make(text, error="m", micro=False).matrix), 6, constant_values=1),
            np.ones((4, 4)),
        )
        for text in texts
    ]
    high = max(code.shape[0] for code in codes)
    padded = [np.pad(code, ((0, high - code.shape[0]), (0, 0)), constant_values=1) for code in codes]
    grey = (np.hstack(padded) * 255).astype(np.uint8)
    return Page("scan.jpg", 1, np.ascontiguousarray(np.rot90(grey, quarter_turns)))


@given(
    assignment=NAMES,
    student=NAMES,
    n=NUMBERS,
    position=NUMBERS,
    kind=st.sampled_from(["all", "velocity", "acceleration"]),
)
def test_what_is_written_in_a_code_is_read_back(assignment, student, n, position, kind):
    identity = Identity(assignment, student, n, position, kind)
    assert identity_of(code_of(identity)) == identity


def test_the_code_is_the_short_text_that_is_documented():
    assert code_of(Identity("pump", "s07", 7, None, "velocity")) == "planmark1|pump|s07|n=7|p=|velocity"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "https://example.org",
        "planmark2|pump|s07|n=7|p=|velocity",
        "planmark1|pump|s07|n=7|p=|velocity|more",
        "planmark1|pump|../../etc|n=7|p=|velocity",
        "planmark1|pump|..|n=7|p=|velocity",
        "planmark1|pump|s07|n=٧|p=|velocity",
        "planmark1|pump|s07|n=7|p=|velocity\n",
        "planmark1|pump|s07|n=99999999999999999999|p=|velocity",
        "planmark1|pump|" + "s" * 300 + "|n=7|p=|velocity",
        "planmark1||s07|n=7|p=|velocity",
        "planmark1|pump|s07|n=7|p=|everything",
    ],
)
def test_hostile_and_foreign_texts_are_no_identity(text):
    assert identity_of(text) is None


def test_an_identity_that_could_not_be_read_back_is_not_printed():
    with pytest.raises(ValueError, match="identity"):
        code_of(Identity("pump", "a|b", None, None, "all"))


@pytest.mark.parametrize("turns", range(4))
def test_a_code_is_read_in_any_of_the_four_turns(turns):
    identity = Identity("press", "Ana.Pop-2", None, 3, "acceleration")
    assert identify(picture(code_of(identity), quarter_turns=turns)) == identity


def test_a_foreign_code_beside_ours_is_passed_over():
    ours = Identity("pump", "s07", 7, None, "all")
    assert identify(picture("WIFI:S:x;P:y;;", code_of(ours))) == ours


def test_two_codes_that_differ_say_nothing():
    first, second = (code_of(Identity("pump", student, 7, None, "all")) for student in ("s07", "s08"))
    assert identify(picture(first, second)) is None


def test_an_empty_page_has_no_identity():
    assert identify(Page("scan.jpg", 1, np.full((800, 1200), 255, np.uint8))) is None
