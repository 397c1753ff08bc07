"""Vectors of force plans, their scale and the balancing moment are judged as other quantities are."""

import cmath
import math
from dataclasses import replace

import pytest

from grader.comparison.criteria import compare
from grader.comparison.evidence import Submission, gather
from grader.comparison.scales import settle
from grader.comparison.task import task_of
from grader.marking.drawn import case_of
from grader.marking.mark import judge
from grader.records import Figure, Reading, Reason, Unread
from grader.rubric import rubric_of
from grader.tables.measurements import columns_of, measurements_in, names_of
from reference.authored.assignment import Variant, library, load_assignment
from reference.construction.mistakes import Drawing, Mistake, mistakes_of_forces
from reference.errors import AuthoredFileError
from reference.numbers import cross
from tests.bench.force_students import force_task
from tests.hands import changed, rule_scales, sheet, task_for, without
from tests.told import tells

LOADED = """
[[page]]
kind = "forces"
figures = ["mechanism", "force_plan_D", "force_plan_B", "force_plan_A"]
[[body]]
link = "3"
mass = 2.5
inertia = 0.02
centre = { base = ["A", "B"], ratio = 0.5 }
[[load]]
link = "slider_D"
force = 800
motion = "against"
"""
ASKED = (
    'scale = "kF"',
    'vector = "F_D"',
    'vector = "R_0D"',
    'vector = "R_02"',
    'vector = "R_31"',
    'moment = "M_b"',
    'sense = "M_b"',
)
HEAD = 'schema_version = 1\nid = "f"\ntitle = { en = "Forces" }\n'
RUBRIC = f"{HEAD}weights = {{ force_plans = 8 }}\n" + "".join(
    f'[[criterion]]\nid = "c{index}"\ntitle = {{ en = "x" }}\npoints = 1\n{one}\n'
    for index, one in enumerate(ASKED)
)


@pytest.fixture
def forces(tmp_path):
    """The pump's assignment with one page of force plans."""

    def load(*changes, rubric=RUBRIC):
        text = (library() / "pump.assignment.toml").read_text(encoding="utf-8")
        pages, data = text.index("# A sheet that"), text.index("# A datum")
        text = text[:pages] + LOADED + text[data:]
        ours = (
            ('ka = "omega**2 * kL"', 'ka = "omega**2 * kL"\nkF = "force / 50"'),
            ('rubric = "pump"', 'rubric = "f"'),
        )
        for old, new in (*ours, *changes):
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "f.assignment.toml").write_text(text, encoding="utf-8")
        (tmp_path / "f.rubric.toml").write_text(rubric, encoding="utf-8")
        return load_assignment(tmp_path / "f.assignment.toml")

    return load


@pytest.fixture
def judged(forces):
    """Marks what a student enters; the verdicts by name."""
    assignment = forces()
    task = task_of(assignment, rubric_of(assignment), Variant(7))

    def mark(longer=1.0, scale="16 N/mm", written=None, **cells):
        """Mark what was entered, and what was written in a sheet's cells.

        Arguments: `longer`, how much longer R_02 was drawn, from which R_31 and the moment follow.
        """
        real = {name: task.real[name] for name in ("F_D", "R_0D", "R_02", "R_31", "F_i3", "R_43", "R_13_t")}
        real["R_31"] += (longer - 1.0) * real["R_02"]
        entered = {"kF": scale}
        for name, force in (real | {"R_02": longer * real["R_02"]}).items():
            entered |= {
                name: f"{abs(force) / 16.0:.2f}",
                f"{name}_deg": f"{math.degrees(cmath.phase(force)):.2f}",
            }
        measured = measurements_in({**entered, **cells}, names_of(assignment), "", "en")
        assert measured.problems == ()
        sheets = () if written is None else (Reading({}, lengths=written),)
        handed_in = Submission(sheets, measured.reading, measured.values, measured.scales)
        return {one.name: one for one in compare(task, handed_in).outcomes}

    arm = task.nodes(task.rule_scales)["A"]
    follows = task.real["R_31"] + 0.5 * task.real["R_02"]
    mark.right = task.rates["M_b"]
    mark.follows = mark.right * cross(arm, follows) / cross(arm, task.real["R_31"])
    return mark


def verdicts(outcomes):
    return {name: one.verdict for name, one in outcomes.items()}


def test_a_right_force_sheet_gets_full_marks(judged):
    found = judged(M_b_value=f"{abs(judged.right):.1f} {'ccw' if judged.right > 0 else 'cw'}")
    assert set(verdicts(found).values()) == {"full"}
    assert found["M_b"].expected.unit == "N m"


def test_a_moment_of_the_other_sense_is_wrong(judged):
    found = judged(M_b_value=f"{-judged.right:.1f}")
    assert (found["M_b"].verdict, found["M_b_sense"].verdict) == ("none", "none")
    assert "value_reversed" in found["M_b"].codes


@pytest.mark.parametrize(
    ("share", "sense", "sure", "verdict", "of_sense"),
    [
        (1.0, 1.0, 1.0, "full", "full"),
        (1.2, 1.0, 1.0, "review", "full"),
        (-1.0, -1.0, 1.0, "review", "none"),
        (1.0, 1.0, 0.0, "review", "review"),
        (1.0, 0.0, 1.0, "review", "review"),
    ],
)
def test_a_moment_in_a_sheets_cells_is_right_or_goes_to_a_person(
    judged, share, sense, sure, verdict, of_sense
):
    is_left = math.copysign(1.0, judged.right)
    value = abs(judged.right) if sense == 0.0 else share * judged.right
    found = judged(written={"M_b_value": (value, 0.99), "M_b_sense": (sense * is_left, sure)})
    assert (found["M_b"].verdict, found["M_b_sense"].verdict) == (verdict, of_sense)
    assert found["M_b"].measured.value == value
    told = f"{abs(judged.right):.1f} {'ccw' if judged.right > 0.0 else 'cw'}"
    entered = judged(M_b_value=told, written={"M_b_sense": (-is_left, 1.0)})
    assert (entered["M_b"].verdict, entered["M_b_sense"].verdict) == ("full", "full")


def test_a_moment_follows_from_the_student_s_own_reactions(judged):
    assert abs(judged.follows / judged.right - 1.0) > 0.05
    found = judged(longer=1.5, M_b_value=f"{judged.follows:.1f}")
    assert found["R_02"].verdict == "none"
    assert (found["R_31"].verdict, found["M_b"].verdict) == ("follow_through", "follow_through")
    assert judged(M_b_value=f"{judged.follows:.1f}")["M_b"].verdict in {"none", "partial"}


def test_a_declared_scale_of_forces_is_held_against_a_given_force(judged):
    assert verdicts(judged(scale="0.016 kN/mm"))["kF"] == "full"
    found = judged(scale="1 mm = 20 N")
    assert found["kF"].verdict == "none"
    assert "scale_off" in found["kF"].codes


def test_what_follows_from_a_load_drawn_too_long_does_not_make_the_declared_scale_wrong(judged):
    right = judged()
    longer = {name: f"{1.5 * right[name].measured.length_mm:.2f}" for name in ("F_D", "R_0D", "R_02", "R_31")}
    blank = dict.fromkeys(("R_43", "R_43_deg", "R_13_t", "R_13_t_deg"), "")
    found = verdicts(judged(**longer, **blank))
    assert (found["kF"], found["F_D"]) == ("full", "none")


def test_inertia_forces_of_wrong_own_accelerations_do_not_make_a_declared_scale_wrong(forces):
    bodies = "".join(
        f'[[body]]\nlink = "{link}"\nmass = 2.5\ncentre = {{ base = [{ends}], ratio = 0.5 }}\n'
        for link, ends in {"2": '"O2", "B"', "4": '"C", "D"'}.items()
    )
    page = '[[page]]\nkind = "acceleration"\nfigures = ["mechanism", "acceleration_plan"]\n'
    names = ("a_A", "a_B", "a_C", "a_D", "a_S2", "a_S3", "a_S4", "F_i2", "F_i3", "F_i4", "F_D")
    asked = "".join(
        f'[[criterion]]\nid = "{one}"\ntitle = {{ en = "x" }}\npoints = 1\nvector = "{one}"\n'
        for one in names
    )
    kept = '[[criterion]]\nid = "kF"\ntitle = { en = "x" }\npoints = 1\nscale = "kF"\n'
    assignment = forces(
        ("[[page]]", f"{page}[[page]]"), ("[[load]]", f"{bodies}[[load]]"), rubric=HEAD + kept + asked
    )
    task = task_of(assignment, rubric_of(assignment), Variant(7))
    entered = {"kF": "16 N/mm", "ka": f"{task.rule_scales['ka']} (m/s2)/mm"}
    for name in names:
        # The driving link turns half as fast.
        share = 1.0 if name == "F_D" else 0.25
        length = share * abs(task.real[name]) / (16.0 if name[0] == "F" else task.rule_scales["ka"])
        entered |= {name: f"{length:.2f}", f"{name}_deg": f"{math.degrees(cmath.phase(task.real[name])):.2f}"}
    measured = measurements_in(entered, names_of(assignment), "", "en")
    handed_in = Submission(measured=measured.reading, values=measured.values, declared=measured.scales)
    said = verdicts({one.name: one for one in compare(task, handed_in).outcomes})
    assert (said["kF"], said["F_D"], said["F_i3"]) == ("full", "full", "follow_through")


def test_the_columns_are_those_of_the_rubric_and_of_the_sheet_s_own_scales(forces):
    assignment = forces()
    columns = columns_of(assignment, rubric_of(assignment))
    assert columns == {
        "kL": "m/mm", "kF": "N/mm", "F_D": "mm", "F_D_deg": "°", "R_0D": "mm", "R_0D_deg": "°",
        "R_02": "mm", "R_02_deg": "°", "R_31": "mm", "R_31_deg": "°",
        "M_b_value": "N m", "M_b_sense": "cw/ccw",
    }  # fmt: skip
    assert [one.section for one in rubric_of(assignment).criterion] == ["scales", *["force_plans"] * 6]


@pytest.mark.parametrize(
    ("change", "path", "words"),
    [
        (
            ('"force_plan_B"', '"force_plan_C"'),
            "$.page[0].figures[2]",
            "C names no group.*force_plan_D, force_pl",
        ),
        (('"force_plan_B"', '"forceplan_B"'), "$.page[0].figures[2]", "force_plan_JOINT"),
        (('\nkF = "force / 50"', ""), "$.scales.kF", "is missing: a page shows a force plan.*kF = 50"),
        (("[[body]]", "[[body]]\ngravity = 9.81"), "$.body[0].gravity", r"above the first \[table\]"),
        (('kF = "force / 50"', 'kF = "forces"'), "$.scales.kF", "unknown name forces"),
    ],
)
def test_a_fault_of_a_page_of_forces_is_told_at_its_path(forces, change, path, words):
    with pytest.raises(AuthoredFileError, check=tells(words)) as error:
        forces(change)
    assert error.value.findings[0].path == path


@pytest.mark.parametrize(
    ("name", "told", "words"),
    [
        ("f", "own", "no page shows the acceleration plan"),
        ("pump", "given", "no page of the assignment shows"),
    ],
)
def test_accelerations_that_no_page_shows_are_a_fault(forces, name, told, words):
    pages = () if name == "f" else ((LOADED[: LOADED.index("[[body]]")], PAGE),)
    assignment = forces(*pages, rubric=f'accelerations = "{told}"\n{RUBRIC if name == "f" else VELOCITIES}')
    with pytest.raises(AuthoredFileError, check=tells(words)) as error:
        rubric_of(assignment)
    assert error.value.findings[-1].path == "$.accelerations"


PAGE = '[[page]]\nkind = "velocity"\nfigures = ["velocity_plan"]\n'
VELOCITIES = HEAD + '[[criterion]]\nid = "v"\ntitle = { en = "x" }\npoints = 1\nvector = "v_B"\n'


# On scans ------------------------------------------------------------------------------------------

PUMP, PRESS = task_for("pump-forces", 7), task_for("press-forces", position=4)
UNSURE, CAPPED = 0.65, 0.8


def on_scan(task, reading, *blank):
    """The verdicts on a sheet that was read; no ink lies along the vectors `blank`."""
    gaps = tuple(Unread(name, Reason("not_found", {"name": name}), is_blank=True) for name in blank)
    told = Reading(without(reading, *blank).figures, gaps)
    return verdicts({one.name: one for one in judge(task, Submission(readings=(told,))).outcomes})


def test_a_force_that_may_be_laid_off_the_wrong_way_waits_where_its_polygon_was_read_in_doubt():
    read = changed(sheet(PUMP), "F_D", confidence=UNSURE)
    assert on_scan(PUMP, read)["F_D"] == "full"
    assert on_scan(PUMP, changed(read, "F_D", confidence=0.55))["F_D"] == "review"
    for name in read.figures["force_plan_D"].vectors:
        read = changed(read, name, confidence=UNSURE)
    found = on_scan(PUMP, read)
    assert (found["F_D"], found["F_iD"], found["R_0D"]) == ("review", "review", "full")


def test_a_force_that_seems_right_waits_where_the_other_sense_of_its_polygon_fits_as_well():
    # All forces reversed leave the same lines: this load as drawn is F_D reversed, or all others are.
    def capped(reading):
        for name in reading.figures["force_plan_D"].vectors:
            reading = changed(reading, name, confidence=CAPPED)
        return reading

    assert on_scan(PUMP, capped(sheet(PUMP)))["F_D"] == "full"
    read = sheet(PUMP)
    inertia = read.figures["force_plan_D"].vectors["F_iD"]
    turned = changed(read, "F_iD", direction_deg=(inertia.direction_deg + 180.0) % 360.0)
    assert on_scan(PUMP, turned)["F_D"] == "full"
    assert on_scan(PUMP, capped(turned))["F_D"] == "review"


def test_two_opposite_forces_wait_where_only_their_names_tell_which_is_which():
    assignment, rubric = force_task("shaper")
    task = task_of(assignment, rubric, assignment.variants()[4])
    found = on_scan(task, sheet(task))
    assert (found["R_A3"], found["R_A1"], found["R_01"]) == ("full", "review", "review")


def test_a_force_read_in_doubt_waits_where_a_side_of_its_polygon_was_not_found():
    read = changed(sheet(PUMP), "F_D", confidence=UNSURE)
    unread = without(read, "R_0D")
    assert (on_scan(PUMP, read)["F_D"], on_scan(PUMP, unread)["F_D"]) == ("full", "review")


def test_sides_too_short_to_have_a_direction_are_no_evidence_for_their_polygon():
    read = changed(changed(sheet(PRESS), "F_D", confidence=UNSURE), "R_24", confidence=UNSURE)
    short = changed(changed(read, "G_D", length_mm=1.0), "R_0D", length_mm=1.0)
    assert (on_scan(PRESS, read)["F_D"], on_scan(PRESS, short)["F_D"]) == ("full", "review")


def test_a_sum_that_is_not_drawn_out_is_measured_between_its_parts():
    read = sheet(PRESS)
    found = on_scan(PRESS, read, "R_02", "F_i2")
    assert (found["R_02"], found["F_i2"]) == ("full", "none")
    assert on_scan(PRESS, read, "R_13")["R_13"] == "full"
    plan, end = read.figures["force_plan_B"], PRESS.construction.vectors["R_02"].tail
    nodes = {**plan.nodes, end: replace(plan.nodes[end], confidence=UNSURE)}
    unsure = replace(read, figures={**read.figures, "force_plan_B": Figure(nodes, plan.vectors)})
    shifted = {**plan.nodes, end: replace(plan.nodes[end], at=plan.nodes[end].at + 9.0)}
    astray = replace(read, figures={**read.figures, "force_plan_B": Figure(shifted, plan.vectors)})
    assert on_scan(PRESS, unsure, "R_02")["R_02"] == "full"
    assert on_scan(PRESS, astray, "R_02")["R_02"] != "full"
    # One that need not be drawn is none.
    assert on_scan(PRESS, read, "R_23")["R_23"] == "not_judged"


def test_inertia_forces_that_are_all_reversed_are_one_mistake_where_the_first_waits():
    right = Drawing(PRESS.construction, PRESS.at(PRESS.rule_scales))
    every = next(
        one for one in mistakes_of_forces(right) if (one.code, one.at) == ("inertia_reversed", "F_i")
    )
    read = changed(sheet(PRESS, mistakes=(every,)), "F_iD", confidence=CAPPED)
    judgement = judge(PRESS, Submission(readings=(read,)))
    assert [(one.code, one.at) for one in judgement.mistakes] == [("inertia_reversed", "F_i")]


def test_the_length_from_moments_is_known_as_well_as_what_it_is_made_of():
    def spread(reading):
        evidence = gather(PUMP, Submission(readings=(reading,)))
        entries = case_of(PUMP, evidence, settle(PUMP, evidence, {})).observations.entries
        head = PUMP.construction.vectors["R_13_t"].head
        return next(one.spread[2] for one in entries if one.node == head)

    read = sheet(PUMP)
    plans = Reading({name: one for name, one in read.figures.items() if name != "mechanism"})
    rough = replace(read, figures={**read.figures, "mechanism": sheet(PUMP, se_mm=0.3).figures["mechanism"]})
    assert spread(read) < spread(rough)
    assert spread(read) < spread(plans)


def test_the_start_of_a_polygon_is_not_known_unless_it_was_read():
    read = sheet(PRESS)
    plan = read.figures["force_plan_D"]
    assert PRESS.construction.vectors["F_iD"].tail == PRESS.construction.poles["force_plan_D"]
    assert on_scan(PRESS, read, "F_iD")["F_iD"] == "none"
    start = PRESS.construction.vectors["F_iD"].tail
    nodes = {**plan.nodes, start: replace(plan.nodes[start], confidence=UNSURE)}
    unsure = replace(read, figures={**read.figures, "force_plan_D": Figure(nodes, plan.vectors)})
    assert on_scan(PRESS, unsure, "F_iD")["F_iD"] == "review"


def test_a_force_that_is_too_long_beside_one_that_was_not_read_waits():
    read = sheet(PRESS)
    length = read.figures["force_plan_D"].vectors["F_D"].length_mm
    longer = changed(read, "F_D", length_mm=1.2 * length)
    assert on_scan(PRESS, longer)["F_D"] in {"none", "partial"}
    assert on_scan(PRESS, without(longer, "F_iD"))["F_D"] == "review"


def test_a_reaction_whose_source_was_not_read_is_not_charged():
    both = sheet(PUMP)
    length = both.figures["force_plan_B"].vectors["R_43"].length_mm
    longer = changed(both, "R_43", length_mm=1.2 * length)
    alone = Reading({name: one for name, one in longer.figures.items() if name != "force_plan_D"})
    assert on_scan(PUMP, longer)["R_43"] in {"none", "partial"}
    assert on_scan(PUMP, alone)["R_43"] == "review"


def test_a_force_is_not_known_to_be_missing_where_it_was_read_so_in_doubt():
    head = PUMP.construction.vectors["F_i2"].head
    read = sheet(PUMP, mistakes=(Mistake("force_missing", head),))
    assert on_scan(PUMP, read)["F_i2"] == "none"
    assert on_scan(PUMP, changed(read, "F_i2", confidence=CAPPED))["F_i2"] == "review"
    assert on_scan(PUMP, with_unsure(read, "F_i2"))["F_i2"] == "none"


def with_unsure(read, name, plan="force_plan_B"):
    """A reading in which the node where a force begins is in doubt."""
    figure, tail = read.figures[plan], PUMP.construction.vectors[name].tail
    nodes = {**figure.nodes, tail: replace(figure.nodes[tail], confidence=UNSURE)}
    return replace(read, figures={**read.figures, plan: replace(figure, nodes=nodes)})


def test_a_doubtful_force_shows_no_scale_where_the_length_in_its_cells_is_another():
    scales = rule_scales(PUMP)
    read = sheet(PUMP, {**scales, "kF": 1.6 * scales["kF"]})
    for name in PUMP.vectors_by_data("kF"):
        read = changed(read, name, confidence=UNSURE)
    declared = {"kF": f"{scales['kF']:g} N/mm"}
    written = replace(read, lengths={"F_D": (abs(PUMP.real["F_D"]) / scales["kF"], 0.99)})
    judged = [judge(PUMP, Submission(readings=(one,), declared=declared)) for one in (read, written)]
    found = [one.verdict for judgement in judged for one in judgement.outcomes if one.name == "kF"]
    assert found == ["none", "review"]
