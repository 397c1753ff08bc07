"""A mechanism file that has every kind of group, guide and driver's datum; and an assignment about it."""

# ruff: noqa: E501 - an inline table of TOML stands on one line

import tomllib

import numpy as np

from reference.authored.assembly import build_mechanism
from reference.authored.mechanism import MechanismFile, check_mechanism
from reference.authored.toml_file import validate
from reference.mechanism import Mechanism

MECHANISM = """
schema_version = 1
id = "every"
title = { en = "Every group" }
length_unit = "mm"
ground = { O1 = [0, 0], O2 = [0, -300], O3 = [400, 100] }
crank = { pivot = "O1", pin = "A", length = 120, angle_deg = "40 + n", rpm = 90, gear_ratio = 1.5, epsilon = 2 }
group = [
  { type = "RPR", node = "A3", pin = "A", pivot = "O2", link = "3" },
  { type = "point", node = "D", base = ["O2", "A3"], link = "3", at = [520, 0] },
  { type = "RRP", node = "E", pin = "D", length = 200, link = "4", guide = { through = [0, 260], angle_deg = 0 }, side = "ahead" },
  { type = "RRR", node = "B", pins = ["A", "O3"], links = ["6", "7"], lengths = [350, 250], side = "left" },
  { type = "plate", node = "C", base = ["A", "B"], link = "6", lengths = [200, 260], side = "left" },
  { type = "point_on_line", node = "F", base = ["O3", "B"], link = "7", ratio = 0.5 },
  { type = "RRP", node = "G", pin = "C", length = 300, link = "8", guide = { joints = ["O3", "B"], coincident = "G7" }, side = "ahead" },
  { type = "PRP", node = "H", guides = [{ joints = ["D", "E"], coincident = "H4" }, { through = [0, 100], angle_deg = 20 }] },
  { type = "RPP", node = "K", pin = "B", slot_deg = 90, guide = { through = [0, -100], angle_deg = 0 } },
  { type = "RPR", node = "C9", pin = "C", pivot = "O1", link = "9", offset = 20, foot = "P", side = "ahead" },
  { type = "point", node = "L", base = ["A", "B"], link = "6", at = [100, -40] },
]
"""
ASSIGNMENT = """
schema_version = 1
id = "every"
title = { en = "Every group" }
task = { en = "Draw the plans." }
rubric = "none"
variant = { n = { from = 1, to = 20 } }
scales = { crank_mm = 40, kL = "crank_m / crank_mm", kv = "omega * kL", ka = "omega * kv" }
page = [{ kind = "all", figures = ["mechanism", "velocity_plan", "acceleration_plan"] }]
"""


def mechanism_table() -> dict:
    """The mechanism, fresh."""
    return tomllib.loads(MECHANISM)


def assignment_table() -> dict:
    """The assignment, fresh, without its mechanism."""
    return tomllib.loads(ASSIGNMENT)


def mechanism(*more: dict) -> Mechanism:
    """The mechanism of the assignment's first variant, with more groups."""
    table = mechanism_table()
    table["group"] += more
    file = validate(MechanismFile, table, "every group")
    assert not list(check_mechanism(file))
    return build_mechanism(file, {"n": np.ones(1)}, 1)
