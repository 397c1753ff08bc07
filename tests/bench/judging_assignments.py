"""The mechanisms that judging is measured on: built-in assignments, and some that no file ships.

The others have what the built-in ones do not: a plate inside a six-bar of two dyads, a slider on a
guide beside the crank's pivot with a dyad hung on its rod. Their rubrics are those that
`planmark new` would write.
"""

import tomllib
from functools import cache
from pathlib import Path

from grader.rubric import RubricFile, rubric_of
from reference.authored.assignment import Assignment, AssignmentFile, load_assignment
from reference.authored.mechanism import check_mechanism
from reference.authored.toml_file import validate
from reference.errors import AuthoredFileError
from tests.whole_rubric import rubric_for

_SCALES = 'scales = { crank_mm = 50, kL = "crank_m / crank_mm", kv = "omega * kL", ka = "kv**2 / kL" }'
_PAGES = """
[[page]]
kind = "velocity"
figures = ["mechanism", "velocity_plan"]

[[page]]
kind = "acceleration"
figures = ["mechanism", "acceleration_plan"]
"""

STEPHENSON = f"""
schema_version = 1
id = "stephenson"
title = {{ en = "Six-bar of Stephenson's third kind" }}
task = {{ en = "Draw the plans." }}
rubric = "stephenson"
variant = {{ n = {{ from = 1, to = 14 }}, values = {{ phi_deg = "334 + 2*n", n1_rpm = "90 + 5*n" }} }}
{_SCALES}
{_PAGES}
[mechanism]
schema_version = 1
id = "stephenson"
title = {{ en = "Six-bar of Stephenson's third kind" }}
length_unit = "mm"
ground = {{ O1 = [0, 0], O2 = [260, -40], O3 = [330, 240] }}
crank = {{ pivot = "O1", pin = "A", length = 90, angle_deg = "phi_deg", rpm = "n1_rpm" }}
group = [
  {{ type = "RRR", node = "B", pins = ["A", "O2"], links = ["2", "3"], lengths = [240, 180], side = "left" }},
  {{ type = "plate", node = "C", base = ["A", "B"], link = "2", lengths = [170, 150], side = "left" }},
  {{ type = "RRR", node = "D", pins = ["C", "O3"], links = ["4", "5"], lengths = [160, 150], side = "left" }},
]
"""

OFFSET = f"""
schema_version = 1
id = "offset"
title = {{ en = "Offset slider-crank with a dyad on its rod" }}
task = {{ en = "Draw the plans." }}
rubric = "offset"
variant = {{ n = {{ from = 1, to = 12 }}, values = {{ phi_deg = "36 + 2*n", n1_rpm = "150 + 10*n" }} }}
{_SCALES}
{_PAGES}
[mechanism]
schema_version = 1
id = "offset"
title = {{ en = "Offset slider-crank with a dyad on its rod" }}
length_unit = "mm"
ground = {{ O1 = [0, 0], O3 = [220, 260] }}
crank = {{ pivot = "O1", pin = "A", length = 80, angle_deg = "phi_deg", rpm = "n1_rpm" }}

[[mechanism.group]]
type = "RRP"
node = "B"
pin = "A"
link = "2"
length = 260
guide = {{ through = [0, -50], angle_deg = 0 }}
side = "ahead"

[[mechanism.group]]
type = "point_on_line"
node = "C"
base = ["A", "B"]
link = "2"
ratio = 0.6

[[mechanism.group]]
type = "RRR"
node = "D"
pins = ["C", "O3"]
links = ["4", "5"]
lengths = [200, 140]
side = "left"
"""

_OWN = {"stephenson": STEPHENSON, "offset": OFFSET}
ASSIGNMENTS = ("pump", "press", "engine", "shaper", "piston", *_OWN)


@cache
def assignment_named(name: str) -> tuple[Assignment, RubricFile]:
    """An assignment and its rubric by name. Raises CallError for an unknown one."""
    if name not in _OWN:
        assignment = load_assignment(name)
        return assignment, rubric_of(assignment)
    file = validate(AssignmentFile, tomllib.loads(_OWN[name]), name)
    if isinstance(file.mechanism, str):  # pragma: no cover - the tables above hold theirs
        raise TypeError(file.mechanism)
    faults = tuple(check_mechanism(file.mechanism))
    if faults:
        raise AuthoredFileError(name, faults)
    assignment = Assignment(file, file.mechanism, Path(f"{name}.assignment.toml"))
    mechanism = assignment.mechanism(assignment.variants()[:1])
    return assignment, rubric_for(name, file.title, mechanism)
