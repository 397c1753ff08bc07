"""Compiled motion against NumPy's: the same numbers to a few roundings, the same refusals."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from reference.assignment import built_in, load_assignment
from reference.errors import CallError, MechanismError
from reference.form import with_arrays
from reference.mechanism import Crank, Mechanism
from reference.motion import move, move_where_possible
from tests.laws.mechanisms import KINDS, after, array, mechanisms, random_mechanism

pytest.importorskip("numba", reason="compiled motion needs the extra 'fast'")

from reference.compiled import by_machine, move_compiled

ROUNDINGS = 4.0
"""In predicted errors: by how much two ways of rounding the same formulas may differ."""
LEAST_ERROR = 1e-15
COINCIDENT = 1e-9
"""Metres; nearer points are one, on two links."""
QUANTITIES = ("position", "velocity", "acceleration", "omega", "epsilon", "transmission")
MOMENTS = np.linspace(0.0, 0.6, 300)
"""Seconds; more moments than a block of the machine, and not a multiple of it."""


FEW = settings(max_examples=6)
"""A mechanism of a new form has its steps written down anew."""


def assert_same(compiled, numpy):
    sure = np.isfinite(numpy.predicted_error)
    assert np.array_equal(np.isfinite(compiled.predicted_error), sure)
    assert np.array_equal(compiled.recomputed, numpy.recomputed)
    for quantity in QUANTITIES:
        ours, theirs = getattr(compiled, quantity), getattr(numpy, quantity)
        assert list(ours) == list(theirs)
        if not ours:
            continue
        size = np.max([np.abs(values) for values in theirs.values()], axis=0)
        if quantity in {"omega", "epsilon"}:
            size = size + swing(numpy, "velocity" if quantity == "omega" else "acceleration")
        allowed = ROUNDINGS * np.maximum(numpy.predicted_error, LEAST_ERROR) * size
        for name, values in theirs.items():
            assert ours[name].dtype == values.dtype
            assert ours[name].shape == values.shape
            assert np.all(np.abs(ours[name] - values)[sure] <= allowed[sure]), (quantity, name)


def swing(motion, rate):
    """The angular rate at which the largest velocity (or acceleration) turns the shortest link."""
    places = np.array(list(motion.position.values()))
    gaps = np.abs(places[:, None] - places[None])
    shortest = np.min(np.where(gaps > COINCIDENT, gaps, np.inf), axis=(0, 1))
    return np.max(np.abs(list(getattr(motion, rate).values())), axis=0) / shortest


def by_both(mechanism, **how):
    return move_where_possible(mechanism, solver=by_machine, **how), move_where_possible(mechanism, **how)


@pytest.mark.parametrize("slider_drives", [False, True])
@pytest.mark.parametrize("kind", KINDS)
@FEW
@given(seed=st.integers(0, 2**32 - 1), before=st.lists(st.sampled_from(KINDS), max_size=3))
def test_every_group_moves_as_by_numpy(kind, slider_drives, seed, before):
    mechanism = random_mechanism(seed, [*before, kind], slider_drives=slider_drives)
    assume(mechanism.groups)
    assert_same(*by_both(after(mechanism, MOMENTS)))


@settings(FEW, max_examples=20)
@given(mechanisms(), st.booleans())
def test_a_single_variant_moves_as_by_numpy(mechanism, accelerations):
    assert_same(*by_both(mechanism, accelerations=accelerations))


@settings(FEW, max_examples=20)
@given(mechanisms())
def test_velocities_alone_are_those_of_both_plans(mechanism):
    many = after(mechanism, MOMENTS)
    alone, both = (by_both(many, accelerations=accelerations)[0] for accelerations in (False, True))
    assert alone.acceleration == {}
    assert alone.epsilon == {}
    for joint, velocity in both.velocity.items():
        assert np.array_equal(alone.velocity[joint], velocity, equal_nan=True)


@settings(FEW, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.lists(st.sampled_from(KINDS), min_size=1, max_size=4))
def test_next_to_a_singular_position_it_is_solved_again_with_more_digits(seed, chain):
    mechanism = random_mechanism(seed, chain, least_sine=1e-12)
    compiled, numpy = (move_where_possible(mechanism, **how) for how in ({"solver": by_machine}, {}))
    assume(numpy.recomputed.all() and compiled.recomputed.all())
    for joint, velocity in numpy.velocity.items():
        assert np.array_equal(compiled.velocity[joint], velocity, equal_nan=True)


@pytest.mark.parametrize("name", built_in())
def test_built_in_assignments_move_as_by_numpy(name):
    assignment = load_assignment(name)
    mechanism = assignment.mechanism(assignment.variants())
    assert_same(move_compiled(mechanism), move(mechanism))


def test_what_does_not_assemble_is_refused_in_the_same_words():
    assignment = load_assignment("pump")
    mechanism = assignment.mechanism(assignment.variants())
    crank = replace(mechanism.crank, angle_rad=np.linspace(0.0, 6.0, 30))
    apart = replace(mechanism, driver=crank)
    with pytest.raises(MechanismError) as by_numpy:
        move(apart)
    with pytest.raises(MechanismError) as compiled:
        move_compiled(apart)
    assert (compiled.value.code, compiled.value.message) == (by_numpy.value.code, by_numpy.value.message)


def test_data_that_all_variants_share_may_be_given_once():
    assignment = load_assignment("pump")
    mechanism = assignment.mechanism(assignment.variants())
    longer = replace(mechanism.groups[0], lengths_m=(array(0.4), np.broadcast_to(0.3, (30,))))
    shared = replace(mechanism, groups=(longer, *mechanism.groups[1:]))
    assert_same(move_compiled(shared), move(mechanism))


def test_a_large_crank_angle_is_reduced_as_by_numpy():
    crank = Crank(
        "1", "O", "A", array(0.1), np.linspace(-1e6, 1e6, 1001), array(1.0), array(0.0), accelerated=False
    )
    assert_same(*by_both(Mechanism({"O": array(0j)}, crank, ())))


def test_mechanisms_of_one_form_share_a_program_and_not_their_data():
    same = array(1.0)
    first, second = (
        Mechanism({"O": array(0j)}, Crank("1", "O", "A", *data, accelerated=True), ())
        for data in (
            (array(0.1), array(0.2), same, same),
            (array(0.1), array(0.2), array(2.0), array(3.0)),
        )
    )
    for mechanism in (first, second):
        assert_same(*by_both(mechanism))


def test_data_of_another_number_of_variants_are_a_wrong_call():
    assignment = load_assignment("pump")
    mechanism = assignment.mechanism(assignment.variants())
    wrong = replace(mechanism.groups[0], lengths_m=(np.full(7, 0.4), np.full(30, 0.3)))
    with pytest.raises(ValueError, match=r"shape \(7,\) for 30 variants"):
        move_compiled(replace(mechanism, groups=(wrong, *mechanism.groups[1:])))


def test_one_variant_has_no_data_for_several():
    crank = Crank("1", "O", "A", array(0.1), array(0.2), array(1.0), array(0.0), accelerated=False)
    mechanism = Mechanism({"O": np.zeros(5, complex)}, crank, ())
    with pytest.raises(ValueError, match=r"shape \(5,\) for 1 variants"):
        move_compiled(mechanism)


@given(mechanisms())
@settings(FEW)
def test_data_of_other_types_and_layouts_are_taken_as_they_are(mechanism):
    many = after(mechanism, MOMENTS)
    wide = with_arrays(many, lambda values: np.repeat(values, 2)[::2] if values.size > 1 else values)
    assert_same(*by_both(wide))


def test_without_numba_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", None)
    monkeypatch.delitem(sys.modules, "reference.machine", raising=False)
    assignment = load_assignment("pump")
    mechanism = assignment.mechanism(assignment.variants())
    with pytest.raises(CallError) as refused:
        move_compiled(mechanism)
    assert refused.value.code == "numba_needed"
    assert "planmark[fast]" in refused.value.message
