"""Names of vectors in running text."""

import html
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.language import symbols


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("v_BA", "<i>v</i><sub>BA</sub>"),
        ("a_BA_n", "<i>a</i><sub>BA</sub><sup>n</sup>"),
        ("n_BA", "<i>n</i><sub>BA</sub>"),
        ("R_k2_t", "<i>R</i><sub>k2</sub><sup>t</sup>"),
        ("F_w", "<i>F</i><sub>w</sub>"),
        ("omega_3", "<i>ω</i><sub>3</sub>"),
        ("epsilon_2", "<i>ε</i><sub>2</sub>"),
        ("kL", "<i>k</i><sub>L</sub>"),
        ("kL·ka = kv²", "<i>k</i><sub>L</sub>·<i>k</i><sub>a</sub> = <i>k</i><sub>v</sub>²"),
        ("along O2B", "along O<sub>2</sub>B"),
        ("from O1", "from O<sub>1</sub>"),
        ("μv", "<i>μ</i><sub>v</sub>"),
        ("a_n = v²/l", "<i>a</i><sub>n</sub> = v²/l"),
        ("omega_k, phi_k", "<i>ω</i><sub>k</sub>, <i>φ</i><sub>k</sub>"),
        ("ωk² and φ1", "<i>ω</i><sub>k</sub>² and <i>φ</i><sub>1</sub>"),
        ("omega_2_sense", "<i>ω</i><sub>2</sub>_sense"),
        ("2·ω3·v_A3A", "2·<i>ω</i><sub>3</sub>·<i>v</i><sub>A3A</sub>"),
        ("the end of v_A.", "the end of <i>v</i><sub>A</sub>."),
    ],
)
def test_names_are_set_with_their_indices(text, shown):
    assert symbols(text) == shown


@pytest.mark.parametrize(
    "text", ["vase", "kv2", "a_b", "nova_A", "skL", "omega", "A3", "CO2", "O2x", "ωkL", "ωv", "ω"]
)
def test_other_words_are_left_alone(text):
    assert symbols(text) == text


@given(st.text())
def test_any_text_keeps_its_letters_and_can_add_no_tag(text):
    shown = str(symbols(text))
    assert set(re.findall(r"<[^>]*>", shown)) <= {"<i>", "</i>", "<sub>", "</sub>", "<sup>", "</sup>"}
    bare = html.unescape(re.sub(r"</?(?:i|sub|sup)>", "", shown))
    assert bare.replace("ω", "omega").replace("ε", "epsilon").replace("φ", "phi").replace("_", "") == (
        text.replace("ω", "omega").replace("ε", "epsilon").replace("φ", "phi").replace("_", "")
    )
