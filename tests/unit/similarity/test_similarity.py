"""Sheets that look alike: independent hands never, copies nearly always; exactness is no evidence."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from grader.documents import MistakeDocument
from grader.similarity import groups
from grader.similarity.drawings import compare_drawings, log_chance
from grader.similarity.groups import CELLS, compared_together, find_similar, ink_map
from grader.similarity.submission import compared_submission
from reference.authored.assignment import Variant, built_in, load_assignment
from samples.simulation import PERFECT
from tests.examples import slow
from tests.unit.feedback.works import report
from tests.unit.similarity import classes
from tests.unit.similarity.classes import any_drawing, changed, drawing, measured, scanned, scanned_class

COPIES = 12


def found(name, submissions, maps=()):
    return {frozenset(one.students): one for one in find_similar(load_assignment(name), submissions, maps)}


# Independent hands --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "variants", "hand", "count"),
    [
        ("pump", "same", "careful", 100),
        ("pump", "same", "sloppy", 60),
        ("press", "same", "careful", 100),
        ("press", "different", "typical", 100),
        ("pump", "different", "sloppy", 60),
        *slow(("press", "same", "typical", 300), ("pump", "different", "careful", 300)),
    ],
)
def test_no_two_of_many_independent_students_look_alike(name, variants, hand, count):
    assert found(name, scanned_class(name, count, hand, variants)) == {}


def test_a_copier_that_enlarges_every_sheet_alike_makes_nobody_alike():
    made = [scanned(drawing("press", seed, seed), seed, scale=0.99) for seed in range(60, 160)]
    assert found("press", made) == {}


def test_the_same_mistake_in_the_same_variant_makes_nobody_alike():
    for code in ("normal_from_absolute", "image_mirrored"):
        assert found("pump", scanned_class("pump", 60, mistakes=(code,))) == {}


def test_a_teacher_who_says_where_everything_belongs_makes_nobody_alike():
    made = []
    for seed, one in enumerate(scanned_class("press", 100, "careful")):
        (sheet,) = one.sheets
        rng = np.random.default_rng([seed, 31])
        placed = {}
        for k, (figure, nodes) in enumerate(sheet.items()):
            first = drawing("press", 1, seed, "careful").sheets[0][figure]
            shift = 100 * (k + 1) - 100j - next(iter(first.values())) + complex(*rng.normal(0, 0.2, 2))
            placed[figure] = {node: at + shift for node, at in nodes.items()}
        made.append(replace(one, sheets=(placed,)))
    assert found("press", made) == {}


@pytest.mark.parametrize("step_mm", [0.5, 0.1])
@pytest.mark.parametrize("name", ["pump", "press"])
def test_measured_values_of_independent_students_are_not_alike(name, step_mm):
    made = [measured(drawing(name, 1, seed), seed, step_mm) for seed in range(100)]
    assert found(name, made) == {}


@pytest.mark.parametrize("step_mm", [0.5, 0.1, 0.01])
def test_values_that_are_exact_are_no_evidence_though_all_have_them(step_mm, monkeypatch):
    monkeypatch.setitem(classes.HANDS, "perfect", PERFECT)
    made = [measured(drawing("press", 1, seed, "perfect"), seed, step_mm, 0.0) for seed in range(30)]
    assert all(one.numbers == other.numbers for one, other in pairwise(made))
    assert found("press", made) == {}


def test_nodes_that_are_read_with_the_same_errors_make_nobody_alike():
    """Six careful students of each of five variants, too few of one variant to see what they share."""
    made = []
    for seed in range(30):
        one = scanned(drawing("pump", seed // 6, seed, "careful"), seed)
        read = {}
        for figure, nodes in one.sheets[0].items():
            off = {node: np.random.default_rng([len(figure), *map(ord, node)]) for node in nodes}
            read[figure] = {node: at + complex(*off[node].normal(0.0, 0.15, 2)) for node, at in nodes.items()}
        made.append(replace(one, sheets=(read,)))
    assert found("pump", made) == {}


def test_dust_in_the_same_places_makes_nobody_alike():
    """Sheets that show next to nothing: specks that two of them share, each too faint for a part to count."""
    maps = [[ink_map(sheet_picture(k), (420.0, 297.0))] for k in range(20)]
    for (sheet,) in maps[:2]:
        sheet[20:] = 0
        sheet[25:110:12, 10:160:12] = 50
    submissions = [replace(drawing("pump", k, k), sheets=()) for k in range(20)]
    assert found("pump", submissions, maps) == {}


def test_values_that_all_of_a_variant_have_wrong_alike_make_nobody_alike():
    """One table of rounded lengths, one wrong protractor: all values of all students are off by the same."""
    made = []
    for seed in range(30):
        one = measured(drawing("pump", 1, seed, "careful"), seed, directions=False)
        off = np.random.default_rng(8).choice([-1.0, 1.0], len(one.numbers))
        values = {name: value + more for (name, value), more in zip(one.numbers.items(), off, strict=True)}
        made.append(replace(one, numbers=values))
    assert found("pump", made) == {}


def test_positions_of_one_student_are_not_held_against_each_other():
    one = drawing("press", 1, 0)
    again = replace(scanned(one, 1), variant=replace(one.variant, position=2))
    assert found("press", [scanned(one, 0), again]) == {}


# Copies -------------------------------------------------------------------------------------------


def share_found(name, made, copy_of):
    hits = 0
    for k in range(COPIES):
        copy = copy_of(k)
        hits += frozenset({made[k].student_id, copy.student_id}) in found(name, [*made, copy])
    return hits / COPIES


@pytest.mark.parametrize(("hand", "least"), [("careful", 0.5), ("typical", 0.75)])
def test_a_drawing_scanned_twice_is_found_in_a_class_of_one_variant(hand, least):
    made = scanned_class("pump", 30, hand)
    again = share_found("pump", made, lambda k: scanned(drawing("pump", 1, k, hand), 5000 + k, "copy"))
    assert again >= least


def test_a_drawing_under_another_number_is_found_and_named_so():
    made = scanned_class("pump", 30, variants="different")
    variants = load_assignment("pump").variants()

    def copy_of(k):
        again = scanned(drawing("pump", k, k), 6000 + k, "copy")
        return replace(again, variant=variants[(k + 7) % len(variants)])

    assert share_found("pump", made, copy_of) >= 0.75
    (one,) = found("pump", [*made, copy_of(0)]).values()
    assert "other_number" in one.why
    assert one.measure < 0.001


def test_a_traced_drawing_with_small_errors_of_its_own_is_found():
    made = scanned_class("pump", 30)

    def copy_of(k):
        return scanned(drawing("pump", 1, k), 7000 + k, "copy", moved_mm=0.15)

    assert share_found("pump", made, copy_of) >= 0.75


@pytest.mark.parametrize("count", [0, 1, 2])
def test_copied_values_are_found_with_one_or_two_changed(count):
    made = [measured(drawing("pump", 1, seed), seed) for seed in range(30)]
    assert share_found("pump", made, lambda k: changed(made[k], k, count)) == 1.0


def test_three_who_copied_each_other_are_one_entry():
    made = scanned_class("pump", 20, variants="different")
    ring = [scanned(drawing("pump", 3, 3), 8000 + k, f"ring{k}") for k in range(2)]
    assert set(found("pump", [*made, *ring])) == {frozenset({"s3", "ring0", "ring1"})}


def test_a_number_named_by_diagnosis_tells_whose_it_is_without_a_measure():
    made = [measured(drawing("pump", k, k), k, directions=False) for k in range(4)]
    slip = replace(made[0], student_id="slip", numbers={}, fits=(made[2].variant, 0.97))
    (one,) = found("pump", [*made, slip]).values()
    assert (set(one.students), one.why, one.measure) == ({"s2", "slip"}, ["other_number"], None)


# Pictures -----------------------------------------------------------------------------------------


def sheet_picture(seed, shift_px=0, *, frame=True):
    """A sheet with lines of its own, and a frame that all have."""
    rng = np.random.default_rng(seed)
    grey = np.full((297 * 2, 420 * 2), 255, np.uint8)
    if frame:
        grey[20:24], grey[-24:-20], grey[:, 40:44] = 60, 60, 60
    for _ in range(14):
        (x, y), angle = rng.uniform((120, 120), (700, 460)), rng.uniform(0, np.pi)
        along = np.arange(rng.integers(60, 200))
        rows = np.clip(y + along * np.sin(angle) + shift_px, 0, 592).astype(int)
        columns = np.clip(x + along * np.cos(angle), 0, 838).astype(int)
        grey[rows, columns], grey[rows + 1, columns] = 80, 80
    return grey


def laid_out(submissions, variant, seed):
    """A drawing with its figures where a teacher wants them, to 0.3 mm."""
    rng = np.random.default_rng([seed, 31])
    (sheet,) = submissions.sheets
    spots = {"mechanism": 110 - 190j, "velocity_plan": 250 - 110j, "acceleration_plan": 330 - 180j}
    placed = {}
    for figure, nodes in sheet.items():
        first = next(iter(drawing("pump", variant, seed, "careful").sheets[0][figure].values()))
        shift = spots[figure] - first + complex(*rng.normal(0.0, 0.3, 2))
        placed[figure] = {node: at + shift for node, at in nodes.items()}
    return replace(submissions, sheets=(placed,))


def drawn_picture(submissions, seed):
    """A sheet with a drawing's nodes joined by lines, and a few letters elsewhere."""
    rng = np.random.default_rng([seed, 41])
    grey = np.full((297 * 2, 420 * 2), 255, np.uint8)
    share = np.linspace(0.0, 1.0, 400)
    for nodes in submissions.sheets[0].values():
        for tail, head in pairwise(nodes.values()):
            at = 2.0 * (tail + share * (head - tail))
            rows, columns = np.clip(-at.imag, 0, 592).astype(int), np.clip(at.real, 0, 838).astype(int)
            grey[rows, columns], grey[rows + 1, columns] = 80, 80
    for x, y in rng.uniform((60, 60), (780, 540), (3, 2)).astype(int):
        grey[y : y + 6, x : x + 4] = 120
    return grey


def test_the_very_same_picture_is_found_though_it_lay_otherwise_and_nothing_was_read():
    submissions = [replace(drawing("pump", k, k), sheets=()) for k in range(12)]
    pictures = [sheet_picture(k) for k in range(11)] + [sheet_picture(4, shift_px=1)]
    maps = [[ink_map(grey, (420.0, 297.0))] for grey in pictures]
    (one,) = found("pump", submissions, maps).values()
    assert (set(one.students), one.why) == ({"s4", "s11"}, ["same_picture"])


def test_frame_desk_and_folds_that_a_few_sheets_share_make_nobody_alike():
    """Three of forty have one desk, frame and fold: too few for the class to show that it is common."""
    pictures = [sheet_picture(k, frame=False) for k in range(40)]
    for grey in pictures[:3]:
        grey[:, :16], grey[:14], grey[-14:] = 0, 0, 0
        grey[30:33, 50:-20], grey[-33:-30, 50:-20], grey[30:-30, 50:53], grey[30:-30, -23:-20] = (
            40,
            40,
            40,
            40,
        )
        grey[:, 415:418] = 30
    submissions = [replace(drawing("pump", k, k), sheets=()) for k in range(40)]
    assert found("pump", submissions, [[ink_map(grey, (420.0, 297.0))] for grey in pictures]) == {}


@pytest.mark.parametrize("read", [False, True])
def test_the_ink_of_two_of_one_variant_is_no_evidence_where_all_follow_one_layout(read):
    made = []
    for seed in range(30):
        variant = max(seed - 1, 0)
        made.append(laid_out(scanned(drawing("pump", variant, seed, "careful"), seed), variant, seed))
    maps = [[ink_map(drawn_picture(one, seed), (420.0, 297.0))] for seed, one in enumerate(made)]
    maps[0] = maps[1]
    first = made[0] if read else replace(made[0], sheets=())
    assert found("pump", [first, *made[1:]], maps) == {}


def test_two_on_printed_sheets_in_a_class_on_plain_paper_are_not_alike_by_their_print():
    pictures = [sheet_picture(k) for k in range(20)]
    for grey in pictures[:2]:
        for k in range(60):
            grey[60 + 8 * k : 62 + 8 * k, 60 + 90 * (k % 8) : 110 + 90 * (k % 8)] = 0
    submissions = [replace(drawing("pump", k, k), sheets=(), printed=k < 2) for k in range(20)]
    assert found("pump", submissions, [[ink_map(grey, (420.0, 297.0))] for grey in pictures]) == {}


def test_a_map_tells_where_the_ink_lies():
    grey = np.full((594, 840), 255, np.uint8)
    grey[100:105, 400:410] = 0
    found_ink = ink_map(grey, (420.0, 297.0))
    assert found_ink.shape == CELLS
    assert np.argwhere(found_ink).tolist() == [[20, 80], [20, 81]]


# The measure --------------------------------------------------------------------------------------


def test_the_chance_of_a_cosine_is_that_of_a_random_direction():
    rng = np.random.default_rng(5)
    for dimensions in (3, 8, 20):
        drawn = rng.normal(size=(200_000, dimensions))
        cosine = drawn[:, 0] / np.linalg.norm(drawn, axis=1)
        for limit in (0.0, 0.3, 0.6):
            told = np.exp(log_chance(np.array(limit), np.array(float(dimensions))))
            assert told == pytest.approx((cosine >= limit).mean(), rel=0.1, abs=2e-4)


def test_chances_of_independent_hands_are_spread_as_chances_are():
    """A share p of the pairs of independent hands has a chance under p, or fewer."""
    submissions = scanned_class("pump", 100)
    told = compare_drawings(load_assignment("pump"), submissions)
    log = told.log_errors[np.triu_indices(len(submissions), 1)]
    for chance in (0.1, 0.01, 0.001):
        assert (log < np.log(chance)).mean() < 1.7 * chance


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_classes_of_any_size_are_compared(count):
    assert found("pump", scanned_class("pump", 30)[:count]) == {}


@pytest.mark.parametrize("name", built_in())
def test_any_assignment_and_any_reading_can_be_compared(name):
    assignment = load_assignment(name)
    rng = np.random.default_rng(3)
    (variant, *_), submissions = assignment.variants(), []
    for k in range(12):
        one = any_drawing(assignment, variant, k)
        (figures,) = one.sheets
        kept = {
            figure: {node: at for node, at in nodes.items() if rng.random() < k / 10.0}
            for figure, nodes in figures.items()
            if rng.random() < 0.8
        }
        submissions.append(
            replace(one, sheets=(kept,), numbers={"v_A": 5.0 * k, "a_A_deg": 1.0, "odd_value": 2.0})
        )
    assert found(name, submissions) == {}


def test_a_very_large_class_is_compared_in_parts_that_keep_variants_together(monkeypatch):
    monkeypatch.setattr(groups, "MOST_TOGETHER", 10)
    variants = [Variant(n=k % 7) for k in range(40)] + [Variant(n=9)] * 23
    parts = compared_together(variants)
    assert sorted(k for part in parts for k in part) == list(range(len(variants)))
    assert max(map(len, parts)) <= 10
    for n in range(7):
        assert sum(any(variants[k].n == n for k in part) for part in parts) == 1
    assert compared_together(variants[:8]) == [list(range(8))]
    assert compared_together([]) == [[]]


@pytest.mark.parametrize("printed", [False, True])
def test_crosses_for_poles_that_are_each_variants_own_make_nobody_alike(printed):
    """Two students of each variant, both with their poles on the crosses of their printed sheets."""
    made = []
    for seed in range(60):
        one = scanned(drawing("pump", seed // 2, seed, "careful"), seed)
        (sheet,) = one.sheets
        rng = np.random.default_rng([seed, 31])
        crosses = np.random.default_rng([seed // 2, 33])
        placed = {}
        for figure, nodes in sheet.items():
            pole = next(iter(drawing("pump", seed // 2, seed, "careful").sheets[0][figure].values()))
            cross = complex(*crosses.normal(200.0, 20.0, 2)) + complex(*rng.normal(0.0, 0.2, 2))
            shift = 0.0 if figure == "mechanism" and printed else cross - pole
            placed[figure] = {node: at + shift for node, at in nodes.items()}
        made.append(replace(one, sheets=(placed,), printed=printed))
    assert found("pump", made) == {}


def test_the_variant_that_the_diagnosis_names_is_known_by_its_number():
    known = {"at": "mechanism", "explains": [], "confidence": 0.9, "parameters": {"n": 9}}
    named = report(mistakes=[MistakeDocument(code="other_variant", **known)])
    assert compared_submission(named, Variant(n=7), None).fits == (Variant(n=9), 0.9)
