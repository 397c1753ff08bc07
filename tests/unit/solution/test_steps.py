"""The construction step by step: every node, its numbers, in three languages; pages and pictures."""

import io
import re
import xml.etree.ElementTree as ET

import numpy as np
import pypdfium2
import pytest

from grader.language import LANGUAGES, tongue
from grader.solution import formulas
from grader.solution.equations import grid_of
from grader.solution.formulas import grid_text, mathml, typeset, unicode_name
from grader.solution.pages import chapters, html_page, pdf, pdf_pages
from grader.solution.sentences import sentence, speaker_of, wording_of
from grader.solution.steps import explain
from reference.authored.assignment import library, load_assignment
from reference.construction.equations import equations
from reference.construction.steps import Given, Pole
from reference.drawing.canvas import Label, Ring, pieces_of, set_pieces
from reference.drawing.forces import scheme_of
from reference.drawing.sheets import BEFORE, NOW, reference_drawing
from reference.drawing.subject import Subject
from reference.drawing.tables import table_rows
from reference.plan import exact_plan
from tests.drawn import CASES, WITH_FORCES, loaded, planned

A3_POINTS, A4_POINTS = (1190.55, 841.89), (595.28, 841.89)
POINT = 0.01
ROUNDED = 0.0051
"""Half the last digit of a length told with two decimals."""


def subject_of(case, lang, folder):
    assignment, plan = planned(case, folder)
    return Subject(assignment, plan, 0, wording_of(tongue(lang)))


def plain(markup):
    return re.sub(r"<[^>]*>", "", str(markup)).replace("&#39;", "'").replace("&gt;", ">")


def in_unicode(formula):
    return formulas.plain(formula, in_unicode=True)


def letters(subject, node):
    return "".join(piece.text for piece in subject.letter(node))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("steps")


@pytest.mark.parametrize("lang", LANGUAGES)
@pytest.mark.parametrize("case", CASES)
def test_every_step_has_its_sentence_with_its_node(case, lang, folder):
    subject = subject_of(case, lang, folder)
    told = [step for section in explain(subject, tongue(lang)) for step in section.steps]
    found = [step for name, step in subject.plan.construction.centres.items() if name in subject.centres]
    assert [step.step for step in told] == [*subject.plan.construction.steps, *found]
    assert [step.number for step in told] == list(range(1, len(told) + 1))
    for step in told:
        sentence = plain(step.sentence)
        assert letters(subject, step.step.node) in sentence
        assert sentence.endswith(".")
        assert "%(" not in sentence
        assert "nan" not in plain(step.text)


@pytest.mark.parametrize("case", CASES)
def test_every_vector_and_every_rate_is_told_with_its_value(case, folder):
    subject = subject_of(case, "en", folder)
    plan = subject.plan
    sections, speaker = explain(subject, tongue("en")), speaker_of(subject, tongue("en"))
    text = "\n".join(plain(s.text) for section in sections for s in section.steps)
    rates = [in_unicode(rate) for section in sections for rate in section.rates]
    for name, values in plan.vectors_si.items():
        symbol = unicode_name(speaker.symbol(name))
        lines = [
            line
            for line in text.split("\n")
            if line.startswith((f"{symbol} =", f"{letters(subject, name)} is zero"))
        ]
        lines += [line for line in text.split("\n") if line.startswith(f"{symbol} / ")]
        assert lines, name
        if not subject.is_zero(name) and " = " in lines[0]:
            value = float(re.findall(r"= ([\d.]+)\s\S+$", lines[0])[0])
            told = abs(values[0]) if lines[0].startswith(f"{symbol} =") else abs(plan.drawn_mm(name)[0])
            assert value == pytest.approx(told, rel=1e-4, abs=ROUNDED)
    for name, values in plan.rates.items():
        if name in plan.construction.driving:
            continue
        line = next(line for line in rates if line.startswith(f"{unicode_name(speaker.symbol(name))} ="))
        value = float(re.findall(r"= ([\d.]+)\srad", line)[0])
        assert value == pytest.approx(abs(values[0]), rel=1e-4, abs=1e-9)
        if not subject.is_zero(plan.construction.rates[name].vector):
            assert ("counter-clockwise" in line) == (values[0] > 0.0)
            assert "clockwise" in line


@pytest.mark.parametrize("case", CASES)
def test_what_is_laid_off_is_told_with_its_drawn_length(case, folder):
    subject = subject_of(case, "en", folder)
    nodes = subject.view.nodes
    for section in explain(subject, tongue("en")):
        for step in section.steps:
            found = re.search(r"lay off .* = ([\d.]+)\smm", plain(step.sentence))
            if isinstance(step.step, Given) and found:
                drawn = abs(complex(nodes[step.step.node]) - complex(nodes[step.step.start]))
                assert abs(float(found[1]) - drawn) <= ROUNDED


def test_a_normal_component_is_told_with_its_formula_and_the_scale(folder):
    subject = subject_of("pump 7", "en", folder)
    steps = {s.step.node: s for section in explain(subject, tongue("en")) for s in section.steps}
    first, second = map(in_unicode, steps["n_BA"].before)
    assert first == "a_BAⁿ = v_BA² / AB = 4.5245² / 0.4 = 51.178\N{NO-BREAK SPACE}m/s²"
    assert second == "a_BAⁿ / k_a = 51.178 / 7.5064 = 6.82\N{NO-BREAK SPACE}mm"
    assert plain(steps["n_BA"].sentence).endswith("parallel to BA, from B towards A; it ends in nBA.")


def test_a_coriolis_component_is_told_with_its_formula(folder):
    subject = subject_of("shaper 5", "en", folder)
    steps = {s.step.node: s for section in explain(subject, tongue("en")) for s in section.steps}
    assert in_unicode(steps["k_A3A"].before[0]).startswith("a_A3Aᶜ = 2 · ω₃ · v_A3A = 2 · ")
    assert "turned by 90° in the sense of ω3" in plain(steps["k_A3A"].sentence)


@pytest.mark.parametrize("case", CASES)
def test_every_equation_holds_on_the_plan_and_what_it_calls_known_is_drawn_or_computed_before(case, folder):
    subject = subject_of(case, "en", folder)
    construction, nodes = subject.plan.construction, subject.view.nodes
    known, order = equations(construction), [step.node for step in construction.steps]
    plans = [node for figure in construction.poles for node in nodes if node in subject.nodes(figure)]
    assert known.keys() == set(plans) - set(construction.poles.values())
    for equation in dict.fromkeys(known.values()):
        left = complex(nodes[equation.left.head]) - complex(nodes[equation.left.tail])
        for terms in equation.sums:
            total = sum(complex(nodes[term.head]) - complex(nodes[term.tail]) for term in terms)
            assert total == pytest.approx(left, abs=1e-9)
        for term in equation.terms:
            assert not term.is_drawn or order.index(term.head) < order.index(equation.left.head)
            if term.along is not None:
                vector = complex(nodes[term.head]) - complex(nodes[term.tail])
                across = (np.conj(complex(term.along.at(subject.view))) * vector).imag
                assert across == pytest.approx(0.0, abs=1e-7)
        # A plan finds two unknowns: with the absolute vector's own, each equality of sums leaves no more.
        unknown = sum(2 - term.known for term in equation.terms)
        assert unknown == 2 * max(len(equation.sums), 1) * bool(equation.sums)


def test_an_equation_tells_size_and_direction_of_each_term_and_its_numbers_only_where_asked(folder):
    subject = subject_of("press 1", "en", folder)
    speaker, equation = speaker_of(subject, tongue("en")), equations(subject.plan.construction)["n_B"]
    grid = grid_of(speaker, equation, with_numbers=True)
    rows = [[in_unicode(cell) for cell in row] for row in grid.rows]
    assert "".join(rows[0]) == "a̅_B=a̅_Bⁿ+a̅_Bᵗ=a̅_A+a̅_BAⁿ+a̅_BAᵗ"
    assert rows[1][1::2] == ["?", "v_B² / O₂B", "?", "✓", "v_BA² / AB", "?"]
    assert rows[2][1::2] == ["", "3.5061", "", "10.857", "2.4159", ""]
    assert rows[3][1::2] == ["", "32.29", "", "100.00", "22.25", ""]
    assert rows[4][1::2] == ["?", "B → O₂", "⊥ O₂B", "✓", "B → A", "⊥ AB"]
    assert grid.underlines[1::2] == (0, 2, 1, 2, 2, 1)
    silent = grid_of(speaker, equation, with_numbers=False).rows
    assert [[in_unicode(cell) for cell in row] for row in silent] == [rows[0], rows[1], rows[4]]


@pytest.mark.parametrize(
    ("case", "told"),
    [
        ("press 1", ["μ_l = O₁A / O₁A_drawn = 0.3 / 45 = 0.0066667 m/mm",
                     "ω₁ = π · n / (30 · U) = π · 1350 / (30 · 23.5) = 6.0158 rad/s",
                     "μ_v = v_A / pa = ω₁ · O₁A / 50 = 6.0158 · 0.3 / 50 = 0.036095 (m/s)/mm",
                     "μ_a = a_A / πa' = ω₁² · O₁A / 100 = 6.0158² · 0.3 / 100 = 0.10857 (m/s²)/mm"]),
        ("pump 7", ["ω₁ = π · n₁ / 30 = π · 370 / 30 = 38.746 rad/s",
                    "k_v = v_A / oa = ω₁ · k_L = 38.746 · 0.005 = 0.19373 (m/s)/mm",
                    "k_a = a_A / o'a' = ω₁² · k_L = 38.746² · 0.005 = 7.5064 (m/s²)/mm"]),
        ("piston 5", ["k_L = 0.005 m/mm", "k_v = v_B / ob = v_B / 60 = 1.05 / 60 = 0.0175 (m/s)/mm"]),
    ],
)  # fmt: skip
def test_scales_and_the_cranks_speed_follow_from_the_assignments_own_formulas(case, told, folder):
    sections = explain(subject_of(case, "en", folder), tongue("en"))
    found = "\n".join(
        in_unicode(one).replace("\N{NO-BREAK SPACE}", " ") for s in sections for one in s.formulas
    )
    for formula in told:
        assert formula in found


@pytest.mark.parametrize("case", ["shaper 5", "press 1"])
def test_formulas_are_well_formed_mathml_and_fit_the_printed_column(case, folder):
    sections = explain(subject_of(case, "ru", folder), tongue("ru"))
    steps = [step for section in sections for step in section.steps]
    for formula in (line for step in steps for line in (*step.before, *step.after)):
        ET.fromstring(f"<p>{mathml(formula)}</p>")
        assert 0.0 < typeset(formula, 2.9).width < 95.0


@pytest.mark.parametrize("case", ["pump 7", "shaper 5", "driving slider", "two crossed guides"])
def test_directions_told_for_vectors_are_those_of_the_plan(case, folder):
    subject = subject_of(case, "en", folder)
    nodes = subject.view.nodes
    for step in (s for section in explain(subject, tongue("en")) for s in section.steps):
        if not isinstance(step.step, Given):
            continue
        drawn = complex(nodes[step.step.node]) - complex(nodes[step.step.start])
        sentence = plain(step.sentence)
        told = re.search(r"from (\w+) towards (\w+);", sentence)
        turned = re.search(r"quarter turn (\S+) from the direction (\w+)→(\w+)", sentence)
        angle = re.search(r"direction ([\d.]+)°", sentence)
        if told:
            link = complex(nodes[told[2]]) - complex(nodes[told[1]])
            assert (np.conj(link) * drawn).real > 0.999 * abs(link) * abs(drawn)
        elif turned:
            link = complex(nodes[turned[3]]) - complex(nodes[turned[2]])
            sense = 1.0 if turned[1] == "counter-clockwise" else -1.0
            assert sense * (np.conj(link) * drawn).imag > 0.999 * abs(link) * abs(drawn)
        elif angle:
            assert np.degrees(np.angle(drawn)) % 360.0 == pytest.approx(float(angle[1]), abs=ROUNDED)


@pytest.mark.parametrize(
    ("lang", "words"),
    [
        ("en", ["Mark the pole o", "perpendicular to", "the guide of D", "11.624 / 0.19373 = 60.00"]),
        ("ro", ["Marcați polul o", "perpendiculară pe", "ghidajul lui D", "11,624 / 0,19373 = 60,00"]),
        ("ru", ["Отметьте полюс o", "перпендикулярно", "направляющей точки D", "60,00\N{NO-BREAK SPACE}мм"]),
    ],
)  # fmt: skip
def test_the_terms_and_the_decimal_mark_are_those_of_the_language(lang, words, folder):
    subject = subject_of("pump 7", lang, folder)
    sections = explain(subject, tongue(lang))
    text = "\n".join(plain(step.text) for section in sections for step in section.steps)
    assert [word for word in words if word not in text] == []
    title = {"en": "Velocity plan", "ro": "Planul vitezelor", "ru": "План скоростей"}[lang]
    assert sections[1].title == title


def test_names_are_those_of_the_assignment_everywhere(folder):
    subject = subject_of("press 1", "ru", folder)
    page = html_page(subject, tongue("ru"))
    assert "<i>π</i>" in page
    assert "<i>μ</i><sub>v</sub>" in page
    assert "<i>o</i>" not in page
    assert "<i>k</i>" not in page


@pytest.mark.parametrize("case", CASES)
def test_each_picture_shows_the_new_step_and_greys_the_earlier_ones(case, folder):
    subject = subject_of(case, "en", folder)
    for chapter in chapters(subject, tongue("en"))[:3]:
        seen = set()
        for step in chapter.steps:
            now = [shape for shape in step.picture.shapes if getattr(shape, "colour", "") == NOW]
            named = {
                "".join(piece.text for piece in set_pieces(s.text, 1.0)) for s in now if isinstance(s, Label)
            }
            letter = letters(subject, step.explanation.step.node)
            assert any(letter in label.split(", ") for label in named)
            before = {
                part
                for s in step.picture.shapes
                if isinstance(s, Label) and s.colour == BEFORE
                for part in "".join(piece.text for piece in set_pieces(s.text, 1.0)).split(", ")
            }
            shown = before | {part for label in named for part in label.split(", ")}
            assert seen <= shown
            seen.add(letter)


def test_what_a_direction_is_taken_from_is_shown_on_the_mechanism(folder):
    subject = subject_of("pump 7", "en", folder)
    for chapter in chapters(subject, tongue("en"))[1:3]:
        for step in chapter.steps:
            assert (step.model is None) == isinstance(step.explanation.step, Pole)


def test_the_page_is_whole_by_itself_and_its_pictures_are_well_formed(folder):
    subject = subject_of("pump 7", "ro", folder)
    page = html_page(subject, tongue("ro"))
    assert page.startswith('<!doctype html>\n<html lang="ro">')
    assert not re.findall(r'(?:src|href)="', page)
    pictures = re.findall(r"<svg.*?</svg>", page, re.DOTALL)
    assert len(pictures) > len(subject.plan.construction.steps)
    for picture in pictures:
        ET.fromstring(picture)


def test_pictures_on_the_page_are_true_to_size(folder):
    subject = subject_of("pump 7", "en", folder)
    picture = ET.fromstring(chapters(subject, tongue("en"))[1].steps[1].picture.svg)
    assert picture.get("width") == f"{float(picture.get('viewBox').split()[2]):g}mm"
    line = next(one for one in picture.iter("{http://www.w3.org/2000/svg}line") if one.get("stroke") == NOW)
    tip = next(one for one in picture.iter("{http://www.w3.org/2000/svg}polygon") if one.get("fill") == NOW)
    start = complex(float(line.get("x1")), float(line.get("y1")))
    end = complex(*map(float, tip.get("points").split()[0].split(",")))
    assert abs(end - start) == pytest.approx(60.0, abs=ROUNDED)


@pytest.mark.parametrize("case", ["press 1", "slotted link with an offset, crank slowing down clockwise"])
def test_the_printed_steps_are_a4_and_hold_every_number(case, folder):
    subject = subject_of(case, "ru", folder)
    document = pypdfium2.PdfDocument(io.BytesIO(pdf_pages(subject, tongue("ru"))))
    assert len(document) > 1
    text = ""
    for page in document:
        assert page.get_size() == pytest.approx(A4_POINTS, abs=POINT)
        text += page.get_textpage().get_text_range()
    for number in range(1, len(subject.plan.construction.steps) + 1):
        assert f"{number}. " in text


@pytest.mark.parametrize("case", ["pump 7", "press 1", "engine 5"])
def test_centres_are_told_and_shown_where_they_are(case, folder):
    subject = subject_of(case, "en", folder)
    nodes = subject.nodes("mechanism")
    chapter = chapters(subject, tongue("en"))[3]
    assert chapter.steps
    for step in chapter.steps:
        centre = subject.centres[step.explanation.step.node]
        told = [float(value) for value in re.findall(r"= ([\d.]+)\smm", plain(step.explanation.sentence))]
        assert told == pytest.approx(
            [abs(centre - nodes[joint]) for joint in step.explanation.step.base], abs=ROUNDED
        )
        if step.picture is not None:
            dots = [s for s in step.picture.shapes if isinstance(s, Ring) and s.colour == NOW]
            assert [complex(*dot.centre).conjugate() for dot in dots] == [pytest.approx(centre, abs=POINT)]


def test_a_similar_image_of_a_link_that_does_not_turn_is_told_as_one_point():
    pump = load_assignment("pump-collinear")
    plan = exact_plan(pump, [pump.variant(7)])
    still = plan.nodes_mm["velocity_plan"]
    nodes = {**plan.nodes_mm, "velocity_plan": {**still, "b": still["a"], "c": still["a"]}}
    object.__setattr__(plan, "nodes_mm", nodes)
    steps = explain(Subject(pump, plan), tongue("en"))[1].steps
    image = next(step for step in steps if step.step.node == "c")
    assert plain(image.sentence).startswith("a and b coincide, and so does c")


def test_a_kind_of_step_without_words_is_refused(folder):
    speaker = speaker_of(subject_of("pump 7", "en", folder), tongue("en"))
    with pytest.raises(ValueError, match="a step with words is expected, not str"):
        sentence(speaker, "step")


def test_the_drawing_and_the_steps_are_the_same_shapes_in_the_pdf(folder):
    assignment, plan = planned("pump 7", folder)
    sheets = [sheet.shapes for sheet in reference_drawing(assignment, plan)]
    document = pypdfium2.PdfDocument(io.BytesIO(pdf(sheets, "Pump, n = 7")))
    assert len(document) == len(sheets)
    assert document[0].get_size() == pytest.approx(A3_POINTS, abs=POINT)
    assert document.get_metadata_value("Title") == "Pump, n = 7"
    printed = document[0].get_textpage().get_text_range()
    for datum in ("49.78", "0.19373", "Velocity plan"):
        assert datum in printed


def test_digits_in_the_middle_of_a_joints_name_are_set_below():
    assert [(piece.text, piece.height) for piece in pieces_of("a3'")] == [("a", 0), ("3", -1), ("'", 0)]


# Force plans ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("lang", LANGUAGES)
@pytest.mark.parametrize("own", [False, True])
@pytest.mark.parametrize("case", WITH_FORCES)
def test_every_force_is_told_with_its_value_and_no_node_of_a_force_plan_is_named(case, own, lang, folder):
    assignment, plan = loaded(case, folder, own=own)
    subject = Subject(assignment, plan, 0, wording_of(tongue(lang)))
    speaker = speaker_of(subject, tongue(lang))
    for section in (one for one in explain(subject, tongue(lang)) if one.figure.startswith("force_plan")):
        whole = "\n".join([grid_text(section.table), *(step.text for step in section.steps)])
        assert not re.search(r"\b\w+\.\d\b(?! mm)", re.sub(r"\d+\.\d+", "", plain(whole))), whole
        assert "%(" not in whole
        assert "nan" not in whole
        for vector in plan.construction.vectors_of(section.figure):
            told = f"{unicode_name(speaker.symbol(vector.name))} ="
            size = speaker.bare(abs(plan.vectors_si[vector.name][0]))
            lines = [line for line in plain(whole).split("\n") if line.startswith(told)]
            assert (
                subject.is_zero(vector.name)
                or any(size in line for line in lines)
                or (f"{size}\N{NO-BREAK SPACE}" in whole)
            ), vector.name


@pytest.mark.parametrize("own", [False, True])
@pytest.mark.parametrize("case", WITH_FORCES)
def test_the_forces_of_every_equation_add_up_to_nothing_and_two_properties_are_unknown(case, own, folder):
    _, plan = loaded(case, folder, own=own)
    known = equations(plan.construction)
    for figure in (one for one in plan.construction.poles if one.startswith("force_plan")):
        nodes = {step.node for step in plan.construction.figures[figure]} - {plan.construction.poles[figure]}
        assert nodes <= known.keys()
        for equation in {known[node] for node in nodes}:
            assert equation.left is None
            assert not equation.terms[0].is_negative
            forces = [plan.vectors_si[one.vector][0] * (-1) ** one.is_negative for one in equation.terms]
            assert abs(sum(forces)) <= 1e-9 * max(map(abs, forces))
            assert sum(2 - term.known for term in equation.terms) == 2


@pytest.mark.parametrize("case", WITH_FORCES)
def test_the_lever_gives_the_same_balance_as_the_force_plans(case, folder):
    assignment, plan = loaded(case, folder, own=False)
    subject = Subject(assignment, plan, 0, wording_of(tongue("en")))
    lever = next(one for one in explain(subject, tongue("en")) if one.figure == "lever")
    found = float(re.findall(r"= ([\d.]+)\sN", in_unicode(lever.rates[-1]))[0])
    balancing = plan.forces.balancing
    assert found == pytest.approx(abs(balancing.moment[0]) + abs(balancing.force[0]), rel=1e-4)
    assert len(lever.table.rows) > len(plan.mechanism.bodies)


def test_large_forces_and_forces_through_the_pole_are_told_in_plain_numbers(folder):
    file = folder / "heavy.assignment.toml"
    crank = '[[body]]\nlink = "1"\nmass = 9000\ncentre = { base = ["O1", "A"], ratio = -0.5 }\n\n[[load]]\n'
    text = (library() / "pump-forces.assignment.toml").read_text(encoding="utf-8")
    file.write_text(text.replace("[[load]]\n", crank, 1), encoding="utf-8")
    assignment = load_assignment(file)
    subject = Subject(assignment, exact_plan(assignment, [assignment.variant(7, None)]), 0)
    lever = next(one for one in explain(subject, tongue("en")) if one.figure == "lever")
    (row,) = [row for row in lever.table.rows if in_unicode(row[0]) == "F_i1"]
    assert in_unicode(row[2]) == "0.00"
    assert in_unicode(row[4]).split("\N{NO-BREAK SPACE}")[0] == "0"
    values = [one.value.partition(" ")[0] for one in list(table_rows(subject, ["force_plan_A"]))[1:]]
    assert max(map(float, values)) > 10_000.0
    assert not [value for value in values if "e" in value]


def test_moments_are_told_with_arms_as_they_are_dimensioned(folder):
    assignment, plan = loaded("driving slider", folder, own=False)
    subject = Subject(assignment, plan, 0, wording_of(tongue("en")))
    section = next(one for one in explain(subject, tongue("en")) if one.figure == "force_plan_B")
    arms = {
        line.split(" ")[0]: float(re.findall(r"= ([\d.]+)\sm$", line)[0])
        for step in section.steps
        for line in map(in_unicode, step.before)
        if line.startswith("h")
    }
    labels = [
        "".join(piece.text for piece in one.text)
        for one in scheme_of(subject, "force_plan_B").shapes
        if isinstance(one, Label) and isinstance(one.text, tuple)
    ]
    drawn = {
        f"h{'₀₁₂₃₄₅'[int(one[1])]}": float(one.split(" = ")[1].split(" ")[0])
        for one in labels
        if one.startswith("h")
    }
    assert len(arms) == 3
    assert drawn == pytest.approx({name: 1e3 * arm for name, arm in arms.items()}, rel=1e-3)
    assert "ΣM_B = " in "\n".join(in_unicode(line) for step in section.steps for line in step.before)


def test_the_vector_that_closes_a_polygon_is_named(folder):
    assignment, plan = loaded("two crossed guides", folder, own=False)
    subject = Subject(assignment, plan, 0, wording_of(tongue("en")))
    section = next(one for one in explain(subject, tongue("en")) if one.figure == "force_plan_A")
    assert plain(section.steps[-1].sentence).endswith("R01 closes the polygon.")


def test_pages_show_the_scheme_of_each_group_and_the_lever(folder):
    assignment, plan = loaded("two crossed guides", folder, own=False)
    subject = Subject(assignment, plan, 0, wording_of(tongue("en")))
    shown = [chapter for chapter in chapters(subject, tongue("en")) if chapter.picture is not None]
    assert [one.section.figure for one in shown] == [*plan.construction.poles, "lever"]
    page = html_page(subject, tongue("en"))
    assert page.count("<svg") == sum(
        1 + sum((step.picture is not None) + (step.model is not None) for step in one.steps) for one in shown
    ) + sum(1 for one in chapters(subject, tongue("en"))[0].steps)
    assert len(pypdfium2.PdfDocument(pdf_pages(subject, tongue("en")))) > 2
