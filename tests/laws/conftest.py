"""Random mechanisms: crank, RRR group, plate, RRP group, points on lines; built from where joints are."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume
from hypothesis import strategies as st

from reference.geometry import cross, dot
from reference.mechanism import Crank, Dyad, FixedGuide, Mechanism, Plate, PointOnLine, Slider
from reference.motion import Motion, move

LEAST_TRANSMISSION = 0.15
"""Mechanisms nearer to a singular position are another matter: their conditioning is stated, not tested."""
LEAST_SPAN = 0.2


def _number(low: float, high: float):
    return st.integers(round(low * 1000), round(high * 1000)).map(lambda thousandths: thousandths / 1000)


def _place(reach: float = 2.0):
    return st.builds(complex, _number(-reach, reach), _number(-reach, reach))


def _array(value):
    return np.array([value])


def _side(node: complex, p: complex, q: complex) -> int:
    return 1 if float(cross(_array(q - p), _array(node - p))[0]) > 0 else -1


@st.composite
def mechanisms(draw) -> Mechanism:
    """A mechanism in which every joint is where it was drawn; never far from well conditioned."""
    o1, o2, a, b, c, d = (draw(_place()) for _ in range(6))
    spans = [abs(a - o1), abs(b - a), abs(b - o2), abs(c - a), abs(c - b), abs(d - c), abs(a - o2)]
    assume(min(spans) > LEAST_SPAN)
    # A plate that is almost flat loses its third point to rounding: either flat by its data, or not.
    flatness = abs(float(cross(_array(b - a), _array(c - a))[0])) / (abs(b - a) * abs(c - a))
    assume(flatness > LEAST_TRANSMISSION)
    angle = draw(_number(0.0, np.pi))
    along = complex(np.cos(angle), np.sin(angle))
    ahead = 1 if float(dot(_array(along), _array(d - c))[0]) > 0 else -1
    crank = Crank(
        link="1",
        pivot="O1",
        pin="A",
        length_m=_array(abs(a - o1)),
        angle_rad=_array(np.angle(a - o1)),
        omega=_array(draw(_number(0.1, 30.0)) * draw(st.sampled_from([-1.0, 1.0]))),
        epsilon=_array(draw(_number(-50.0, 50.0))),
        accelerated=True,
    )
    groups = (
        Dyad("B", ("A", "O2"), ("3", "2"), (_array(abs(b - a)), _array(abs(b - o2))), _side(b, a, o2)),
        Plate(
            "C",
            ("A", "B"),
            "3",
            (_array(abs(c - a)), _array(abs(c - b))),
            _side(c, a, b),
            _array((c - a) / (b - a)),
        ),
        Slider(
            "D", "C", "4", _array(abs(d - c)), FixedGuide(_array(d + 0.7 * along), _array(angle)), ahead
        ),
        PointOnLine("E", ("C", "D"), "4", _array(draw(_number(-1.0, 2.0)))),
        PointOnLine("F", ("O2", "B"), "2", _array(draw(_number(-1.0, 2.0)))),
    )
    mechanism = Mechanism({"O1": _array(o1), "O2": _array(o2)}, crank, groups)
    sines = move(mechanism, accelerations=False).transmission.values()
    assume(min(float(sine[0]) for sine in sines) > LEAST_TRANSMISSION)
    return mechanism


def moved(mechanism: Mechanism, **crank) -> Motion:
    """The motion with some of the crank's data changed."""
    changed = {name: _array(value) for name, value in crank.items()}
    return move(replace(mechanism, driver=replace(mechanism.crank, **changed)))


@pytest.fixture(scope="session")
def with_crank():
    return moved


def pytest_configure(config):  # noqa: ARG001 - pytest's signature
    st.register_type_strategy(Mechanism, mechanisms())
