"""Cases for tests of drawings and steps: built-in assignments, and a mechanism of each other kind."""

from functools import cache

from reference.authored.assignment import load_assignment
from reference.mechanism import SLIDER, named_links, points_of
from reference.plan import exact_plan
from tests import every_group

HEAD = """
schema_version = 1
id = "{name}"
rubric = "{name}"
title = {{ en = "{name}" }}
task = {{ en = "Draw it" }}
[scales]
crank_mm = 40
kL = 0.0025
kv = 0.025
ka = 0.25
[[page]]
kind = "all"
figures = ["mechanism", "velocity_plan", "acceleration_plan"]
[mechanism]
schema_version = 1
id = "{name}"
title = {{ en = "{name}" }}
length_unit = "mm"
"""
"""An assignment and its mechanism, which ground, crank and groups complete."""
_FOUR_BAR = """
ground = { O1 = [0, 0], O2 = [250, 0] }
crank = { pivot = "O1", pin = "A", length = 100, angle_deg = 60, omega = 10 }
[[mechanism.group]]
type = "RRR"
node = "B"
pins = ["A", "O2"]
lengths = [260, 200]
links = ["2", "3"]
side = "left"
"""
MECHANISMS = {
    "slotted link with an offset, crank slowing down clockwise": """
ground = { O1 = [0, 0], O2 = [300, 20] }
crank = { pivot = "O1", pin = "A", length = 100, angle_deg = 75, omega = -10, epsilon = 20 }
[[mechanism.group]]
type = "RPR"
node = "A3"
pin = "A"
pivot = "O2"
link = "3"
offset = 50
foot = "F"
[[mechanism.group]]
type = "point"
node = "C"
base = ["O2", "A3"]
link = "3"
at = [40, 60]
""",
    "yoke": """
ground = { O1 = [0, 0] }
crank = { pivot = "O1", pin = "A", length = 100, angle_deg = 40, omega = 10 }
[[mechanism.group]]
type = "RPP"
node = "B"
pin = "A"
slot_deg = 90
guide = { through = [0, 0], angle_deg = 0 }
""",
    "yoke on a moving link": _FOUR_BAR + """
[[mechanism.group]]
type = "RPP"
node = "E5"
pin = "E"
link = "5"
guide = { joints = ["O2", "B"], coincident = "E3" }
[[mechanism.group]]
type = "point_on_line"
node = "E"
base = ["O1", "A"]
link = "1"
ratio = 1.4
""",
    "two crossed guides": _FOUR_BAR + """
[[mechanism.group]]
type = "PRP"
node = "D"
guides = [ { joints = ["A", "B"], coincident = "D2" }, { through = [160, 0], angle_deg = 90 } ]
""",
    "slider on a moving link": _FOUR_BAR + """
[[mechanism.group]]
type = "RRP"
node = "D"
pin = "A"
link = "4"
length = 250
guide = { joints = ["O2", "B"], coincident = "D3" }
side = "behind"
""",
    "driving slider": """
ground = { O2 = [0, 0] }
[mechanism.driving_slider]
pin = "A"
guide = { through = [0, -50], angle_deg = 0 }
displacement = -300
speed = 900
acceleration = 2000
[[mechanism.group]]
type = "RRR"
node = "B"
pins = ["A", "O2"]
lengths = [280, 120]
links = ["2", "3"]
side = "left"
[[mechanism.group]]
type = "plate"
node = "C"
base = ["A", "B"]
link = "2"
lengths = [140, 200]
side = "left"
""",
}  # fmt: skip
BUILT_IN = {
    "pump 1": ("pump", 1, None), "pump 7": ("pump", 7, None), "pump 30": ("pump", 30, None),
    "pump-collinear 7": ("pump-collinear", 7, None), "press 0": ("press", None, 0),
    "press 1": ("press", None, 1), "press 4": ("press", None, 4), "engine 5": ("engine", 5, None),
    "shaper 5": ("shaper", 5, None), "piston 5": ("piston", 5, None),
}  # fmt: skip
CASES = (*BUILT_IN, *MECHANISMS)


CYLINDER = """
ground = { O1 = [0, 0], O2 = [200, -50] }
[mechanism.crank]
pivot = "O1"
pin = "A"
length = 100
cylinder = { pivot = "O2", length = 150, speed = 40, side = "left" }
[[mechanism.group]]
type = "RPR"
node = "A3"
pin = "A"
pivot = "O2"
link = "3"
"""
WITH_FORCES = (*MECHANISMS, "every group", "cylinder", "light cylinder")
"""Mechanisms that `loaded` gives bodies, all but a light cylinder that drives."""


@cache
def loaded(case, folder, *, own):
    """The assignment and plan of a case whose links all have bodies; with its own accelerations or given."""
    head, _, inner = (HEAD + MECHANISMS.get(case, "")).partition("[mechanism]")
    if case == "every group":
        inner = every_group.MECHANISM.replace("40 + n", "43")
    inner += CYLINDER if case.endswith("cylinder") else ""
    name = f"f{WITH_FORCES.index(case)}{'own' if own else ''}"
    head = head.format(name=name).replace("[scales]", "[scales]\nkF = 5")
    text = f"{head}[mechanism]{inner.replace('{{', '{').replace('}}', '}').replace('{name}', name)}"
    file = folder / f"{name}.assignment.toml"
    file.write_text(text, encoding="utf-8")
    bare = load_assignment(str(file))
    mechanism = bare.mechanism(bare.variants())
    cylinder = getattr(mechanism.driver, "cylinder", None)
    plans = [node for node, links in named_links(mechanism).items() if links and cylinder not in links]
    plans.append(mechanism.driver.pin)
    figures = ["mechanism", *(f"force_plan_{one}" for one in plans)]
    text = text.replace('"mechanism", "velocity_plan", "acceleration_plan"', str(figures)[1:-1])
    if own:
        text += '\n[[page]]\nkind = "acceleration"\nfigures = ["mechanism", "acceleration_plan"]\n'
    text = text.replace("[scales]", "gravity = 9.81\n[scales]")
    loaded_links = {
        link: points
        for link, points in points_of(mechanism).items()
        if case != "light cylinder" or link == "1"
    }
    for link, points in loaded_links.items():
        centre = "" if link.startswith(SLIDER) else f'centre = "{points[-1]}"'
        text += f'\n[[body]]\nlink = "{link}"\nmass = 2\ninertia = 0.05\n{centre}\n'
    link, points = [*loaded_links.items()][-1]
    text += f'[[load]]\nlink = "{link}"\npoint = "{points[0]}"\nforce = 300\nangle_deg = 200\n'
    file.write_text(text, encoding="utf-8")
    assignment = load_assignment(str(file))
    return assignment, exact_plan(assignment, assignment.variants())


@cache
def planned(case, folder):
    """The assignment and the plan of one case; files of our own are written into the folder."""
    if case in BUILT_IN:
        name, n, position = BUILT_IN[case]
        assignment = load_assignment(name)
        return assignment, exact_plan(assignment, [assignment.variant(n, position)])
    name = f"m{list(MECHANISMS).index(case)}"
    file = folder / f"{name}.assignment.toml"
    file.write_text(HEAD.format(name=name) + MECHANISMS[case], encoding="utf-8")
    assignment = load_assignment(str(file))
    return assignment, exact_plan(assignment, assignment.variants())
