"""Values that books measured on their own drawn plans get the marks of good work when entered.

The books print values, not millimetres, so each plan is assumed to have the size of a book's figure: then
everything gets full marks. At one and a half times that size, with larger errors in millimetres, nothing
is marked as wrong and no mistake is named.
"""

import cmath
import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.marking.mark import judge
from grader.tables.measurements import Names, reading_of
from reference.authored.assignment import Assignment, AssignmentFile
from reference.authored.toml_file import validate
from tests.whole_rubric import rubric_for

FIGURE_MM, LARGE_MM = 40.0, 60.0
"""Longest vector of a plan that fills half the width of a book's page; and of a student's own."""
CREDIT = {"full", "follow_through"}

PUBLISHED = json.loads((Path(__file__).parent / "published.json").read_text(encoding="utf-8"))
WITH_CORIOLIS = [case for case in PUBLISHED if "share_of_plan" in case]
COMPUTED = next(case for case in PUBLISHED if case["id"] == "R-RTR-RRT six-bar")
DRAWN = ("khurmi/8.1", "khurmi/7.2", "khurmi/7.1", "khurmi/8.4", "khurmi/8.5", "slidepub/7-feb")
NAMES = {
    "vD_abs": "v_D", "aD_abs": "a_D", "vP_abs": "v_B", "vC_abs": "v_B", "vB_abs": "v_B", "aB_abs": "a_B",
    "w_rod": "omega_3", "w_QR": "omega_3", "w_AB": "omega_3", "w_CD": "omega_2", "w_RS": "omega_2",
    "w_P2B": "omega_2", "alpha_rod": "epsilon_3", "alpha_QR": "epsilon_3", "alpha_AB": "epsilon_3",
    "alpha_RS": "epsilon_2", "alpha_P2B": "epsilon_2",
}  # fmt: skip
"""Our names of vectors and rates, by the names of the books' values."""


def assignment_of(mechanism: dict, kv: float = 1.0, ka: float = 1.0) -> Assignment:
    table = {
        "schema_version": 1,
        "id": "case",
        "title": {"en": "case"},
        "task": {"en": "Draw the plans."},
        "rubric": "case",
        "scales": {"crank_mm": FIGURE_MM, "kL": "crank_m / crank_mm", "kv": kv, "ka": ka},
        "page": [{"kind": "all", "figures": ["mechanism", "velocity_plan", "acceleration_plan"]}],
        "mechanism": {
            "schema_version": 1,
            "id": "case",
            "title": {"en": "case"},
            "length_unit": "m",
            **mechanism,
        },
    }
    file = validate(AssignmentFile, table, "case")
    return Assignment(file, file.mechanism, Path("case.assignment.toml"))


def task(mechanism: dict, size_mm: float = FIGURE_MM):
    """The task with both plans at such a size."""
    rough = assignment_of(mechanism)
    variants = rough.variants()
    # Books print what they ask for, not every vector of the plan.
    whole = rubric_for("case", rough.file.title, rough.mechanism(variants))
    rubric = whole.model_copy(update={"missing": "not_judged"})
    real = task_of(rough, rubric, variants[0]).real
    scales = [
        max(abs(vector) for name, vector in real.items() if name.startswith(kind)) / size_mm for kind in "va"
    ]
    return task_of(assignment_of(mechanism, *scales), rubric, variants[0])


def four_bar(spans: list[float], angle_deg: float, omega: float, epsilon: float = 0.0) -> dict:
    first, second, third, base = spans
    coupler = {"type": "RRR", "node": "B", "pins": ["A", "O2"], "links": ["3", "2"], "side": "left"}
    driving = {"pivot": "O1", "pin": "A", "length": first, "angle_deg": angle_deg, "omega": omega}
    return {
        "ground": {"O1": [0, 0], "O2": [base, 0]},
        "crank": {**driving, "epsilon": epsilon},
        "group": [{**coupler, "lengths": [second, third]}],
    }


def slider_crank(told: dict) -> dict:
    guide = {"through": [0, 0], "angle_deg": 0}
    rod = {
        "type": "RRP",
        "node": "B",
        "pin": "A",
        "link": "3",
        "length": told["l"],
        "side": "ahead",
        "guide": guide,
    }
    middle = {"type": "point_on_line", "node": "D", "base": ["A", "B"], "link": "3", "ratio": 0.5}
    driving = {
        "pivot": "O1",
        "pin": "A",
        "length": told["r"],
        "angle_deg": told["crank_deg"],
        "rpm": told["rpm"],
    }
    return {"ground": {"O1": [0, 0]}, "crank": driving, "group": [rod, middle]}


def mechanism_of(told: dict) -> dict:
    if "r" in told:
        return slider_crank(told)
    if "BAD_deg" in told:
        spans = [told["AB"], told["BC"], told["CD"], told["AD"]]
        return four_bar(spans, told["BAD_deg"], math.pi * told["rpm"] / 30)
    if "QPS_deg" in told:
        return four_bar([told["PQ"], told["QR"], told["RS"], told["PS"]], told["QPS_deg"], told["omega"])
    spans = [told["P1A"], told["AB"], told["P2B"], told["P1P2"]]
    return four_bar(spans, told["AP1P2_deg"], told["omega"], told["alpha"])


def entered(case_task, printed: dict[str, float], *, as_segments: bool) -> Submission:
    """The printed magnitudes as a student enters them; the sense of a rotation is the one drawn."""
    scales = {name: float(case_task.parameters[name]) for name in ("kv", "ka")}
    values, lengths = {}, {}
    for name, value in printed.items():
        if name in case_task.rates:
            values[name] = math.copysign(value, case_task.rates[name])
        elif as_segments:
            lengths[name] = value / scales[case_task.segments[name].scale]
        else:
            values[name] = value
    plans = {"v": "velocity_plan", "a": "acceleration_plan"}
    names = Names({name: plans[name[0]] for name in case_task.construction.vectors}, ())
    return Submission(measured=reading_of(names.vectors, lengths, {}), values=values)


def cases(shared: Path) -> list[tuple[str, dict, dict[str, float]]]:
    """Every case that was read off a drawing: its name, mechanism, and values by our names."""
    known = json.loads((shared / "authorities" / "cases.json").read_text(encoding="utf-8"))
    plain = [
        (
            one["id"],
            mechanism_of(one["inputs"]),
            {NAMES[name]: value for name, value in one["published"].items()},
        )
        for one in known
        if one["id"].startswith(DRAWN)
    ]
    return [*plain, *with_coriolis()]


def with_coriolis() -> list[tuple[str, dict, dict[str, float]]]:
    return [
        (
            case["id"],
            case["mechanism"],
            {
                name.strip("|"): value
                for name, value in case["published"].items()
                if not name.startswith("|r")
            },
        )
        for case in WITH_CORIOLIS
    ]


def verdicts(mechanism: dict, printed: dict[str, float], size_mm: float, *, as_segments: bool):
    case_task = task(mechanism, size_mm)
    rubric = case_task.rubric.model_copy(update={"values_alone": True})
    judgement = judge(replace(case_task, rubric=rubric), entered(case_task, printed, as_segments=as_segments))
    return judgement, {one.name: one.verdict for one in judgement.outcomes if one.name in printed}


@pytest.mark.parametrize("as_segments", [True, False], ids=["segments", "values"])
def test_a_books_drawn_plan_gets_full_marks(as_segments, shared):
    for name, mechanism, printed in cases(shared):
        judgement, found = verdicts(mechanism, printed, FIGURE_MM, as_segments=as_segments)
        assert found.keys() == printed.keys()
        assert set(found.values()) <= CREDIT, name
        assert not judgement.mistakes, name


@pytest.mark.parametrize("as_segments", [True, False], ids=["segments", "values"])
def test_enlarged_nothing_of_it_is_wrong_and_no_mistake_is_named(as_segments, shared):
    for name, mechanism, printed in cases(shared):
        judgement, found = verdicts(mechanism, printed, LARGE_MM, as_segments=as_segments)
        assert "none" not in found.values(), name
        assert not judgement.mistakes, name


def test_a_coriolis_component_follows_from_a_books_own_sliding_velocity():
    mechanism, printed = next(rest for name, *rest in with_coriolis() if name == "khurmi/8.16")
    _, found = verdicts(mechanism, printed, LARGE_MM, as_segments=True)
    assert found["v_BC"] in CREDIT
    assert found["a_BC_c"] == "follow_through"


def test_a_textbooks_computed_vectors_score_full_marks():
    case_task = task(COMPUTED["mechanism"])
    vectors = {
        name: complex(*value) / float(case_task.parameters[case_task.segments[name].scale])
        for name, value in COMPUTED["published"].items()
        if name in case_task.construction.vectors
    }
    lengths = {name: abs(vector) for name, vector in vectors.items()}
    turns = {name: math.degrees(cmath.phase(vector)) for name, vector in vectors.items()}
    plans = {"v": "velocity_plan", "a": "acceleration_plan"}
    names = Names({name: plans[name[0]] for name in vectors}, ())
    rates = {name: COMPUTED["published"][name] for name in case_task.rates}
    handed_in = Submission(measured=reading_of(names.vectors, lengths, turns), values=rates)
    judgement = judge(case_task, handed_in)
    asked = {*vectors, *rates}
    assert len(asked) > 10
    assert {one.verdict for one in judgement.outcomes if one.name in asked} == {"full"}
    assert not judgement.mistakes


def test_every_case_that_was_read_off_a_drawing_is_among_them(shared):
    known = json.loads((shared / "authorities" / "cases.json").read_text(encoding="utf-8"))
    read_off = {one["id"] for one in known if "graphical" in one["accuracy"] or "hand" in one["accuracy"]}
    assert read_off <= {name for name, _, _ in cases(shared)}
    assert WITH_CORIOLIS
