"""Calls that cannot be carried out end with their status, one message, and nothing written."""

import re

import pytest


@pytest.mark.parametrize(
    ("call", "status", "words"),
    [
        ("plan pmup", 2, "built in are engine, piston, press"),
        ("plan pump", 2, "needs --n (n = 1..30)"),
        ("plan pump --n 31", 2, "has n = 1..30"),
        ("plan press --position 8", 2, "has position = 0..7"),
        ("plan nowhere.toml --n 1", 2, "no such file"),
        ("plan pump --n 1 --crank-mm 0", 2, "above 0"),
        ("plan pump --n 1 --crank-mm nan", 2, "above 0"),
        ("plan pump --n one", 2, "--n must be a whole number"),
        ("plan pump --m 1", 2, "there is no option --m (did you mean --n?)"),
        ("serve --port 99999", 2, "--port must be at most 65535"),
        ("schema rapport", 2, "known are"),
        ("plan pump --n 1 --svg /proc/plan.svg", 5, "cannot be written"),
        ("plan press --position 1 --altitude --svg plan.svg", 2, "kL ka / kv^2 = 0.555556"),
        ("plan pump --n 7 --altitude", 2, "name a file by --svg or --pdf"),
        ("plan pump --n 7 --steps steps.docx", 2, "must end in .html, .pdf"),
        ("plan pump --n 7 --steps steps.html --lang de", 2, "choose one of en, ro, ru"),
        ("plan pump --all --n 3", 2, "--n has no meaning beside --all"),
        ("plan press --all --position 3", 2, "--position has no meaning beside --all"),
        ("plan pump --all --svg x.svg", 2, "--pdf"),
        ("plan pump --all --pdf x.pdf --altitude", 2, "--altitude has no meaning beside --all"),
        ("plan pump --all --steps x.html", 2, "--steps has no meaning beside --all"),
        ("plan pump --n 3 --csv x.csv", 2, "add --all"),
        ("plan pump --all --csv x.csv --lang de", 2, "choose one of en, ro, ru"),
        ("plan pump --all --crank-mm -3", 2, "above 0"),
        (
            "cycle press --position 1 --of v_Q --csv c.csv",
            2,
            "no 'v_Q' on this cycle (did you mean",
        ),
        ("cycle press --position 1 --of v_B,V_d --csv c.csv", 2, "did you mean v_D?"),
        ("cycle press --position 1 --of omega_9 --csv c.csv", 2, "did you mean omega_"),
        ("cycle press --position 1 --samples 2 --csv c.csv", 2, "a whole number from 3 to 100001"),
        ("cycle press --position 1 --samples -5 --csv c.csv", 2, "a whole number from 3 to 100001"),
        ("cycle press --position 1 --samples many --csv c.csv", 2, "--samples must be a whole number"),
        ("cycle press --position 1 --lang de --csv c.csv", 2, "en, ro, ru"),
        ("cycle press --csv c.csv", 2, "needs --position"),
    ],
)
def test_a_wrong_call_ends_with_its_status_and_one_message(planmark, tmp_path, call, status, words):
    ran = planmark(*call.split())
    assert ran.returncode == status
    assert words in " ".join(ran.stderr.replace("│", " ").split())
    assert "Traceback" not in ran.stderr
    assert ran.stdout == ""
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("call", "status"),
    [
        ("plan pump", 2),
        ("plan press --position 8", 2),
        ("plan", 2),
        ("plan pump --m 1", 2),
        ("plan pump --n one", 2),
        ("plan pump --n 1 --json=x", 2),
        ("plan pump extra --n 1", 2),
        ("plann pump", 2),
        ("grade --out out", 2),
        ("schema rapport", 2),
        ("plan mine.assignment.toml --n 3", 3),
        ("plan mine.assignment.toml --all", 3),
        ("lint mine.rubric.toml", 2),
        ("grade missing.zip --assignment pump --out out", 2),
        ("grade . --assignment pump --roster no.csv --out out", 2),
        ("plan pump --n 1 --svg /proc/plan.svg", 5),
    ],
)
def test_a_wrong_call_is_told_in_the_language_of_the_call(planmark, tmp_path, call, status):
    assert planmark("new", "mine").returncode == 0
    path = tmp_path / "mine.mechanism.toml"
    path.write_text(path.read_text(encoding="utf-8").replace("[40, 30]", "[4, 3]"), encoding="utf-8")
    english = planmark(*call.split())
    for lang in ("ro", "ru"):
        ran = planmark(*call.split(), "--lang", lang)
        assert (ran.returncode, english.returncode) == (status, status)
        words, others = (set(re.findall(r"(?u)[^\W\d_]{4,}", one.stderr)) for one in (ran, english))
        assert len(words - others) >= 2, ran.stderr


def test_what_assembles_for_no_variant_is_told_with_the_variant_in_every_language(planmark, tmp_path):
    assert planmark("new", "mine").returncode == 0
    path = tmp_path / "mine.mechanism.toml"
    path.write_text(path.read_text(encoding="utf-8").replace("[40, 30]", "[4, 3]"), encoding="utf-8")
    for lang in ("en", "ro", "ru"):
        ran = planmark("plan", "mine.assignment.toml", "--all", "--lang", lang)
        assert ran.returncode == 3
        assert "n = 1" in ran.stderr


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (("plan", "pump", "--n", "7"), "vector, punct"),
        (("cycle", "press", "--position", "1"), "manivela se rotește complet"),
        (("new", "own.assignment.toml"), "urmează:"),
        (("handout", "pump", "--n", "3", "-o", "h.pdf"), "foi cu teme"),
        (("plan", "pump", "--all"), "lungime desenată"),
    ],
)
def test_what_a_command_prints_is_in_the_language_of_the_call(planmark, call, told):
    assert told in planmark(*call, "--lang", "ro").stdout


def test_a_class_s_language_holds_for_a_call_that_cannot_be_read(planmark, tmp_path):
    (tmp_path / "planmark.toml").write_text('assignment = "pump"\nlanguage = "ru"\n', encoding="utf-8")
    assert "нет параметра --bogus" in planmark("grade", "--bogus").stderr
    assert "there is no option --bogus" in planmark("grade", "--bogus", "--lang", "en").stderr
