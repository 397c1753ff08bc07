"""A rubric that asks for everything that a construction draws, for mechanisms without a rubric file."""

from collections.abc import Iterator
from typing import Literal

from grader.rubric import CriterionTable, HandTable, RubricFile, ToleranceTable
from reference.authored.toml_file import Text
from reference.construction.derive import construction_of
from reference.construction.graph import Construction, Vector
from reference.mechanism import Mechanism, Plate

POINTS = {"v": 2.0, "a": 2.0, "n": 2.0, "t": 1.0, "c": 2.0, "r": 1.0}
"""Points of a velocity, of an acceleration, and of its parts."""
SCALES: tuple[Literal["kL", "kv", "ka"], ...] = ("kL", "kv", "ka")


def rubric_for(name: str, title: Text, mechanism: Mechanism) -> RubricFile:
    """Scales, links, vectors and angular quantities; what students may leave out without harm is optional."""
    return RubricFile(
        schema_version=1,
        id=name,
        title=title,
        tolerance=ToleranceTable(
            length_mm=1.0, length_relative=0.02, direction_deg=1.5, across_mm=0.5, least_mm=3.0
        ),
        hand=HandTable(sigmas=4.0, at_most=2.5),
        criterion=list(_criteria(mechanism, construction_of(mechanism))),
    )


def _criteria(mechanism: Mechanism, construction: Construction) -> Iterator[CriterionTable]:
    for scale in SCALES:
        yield CriterionTable(id=scale, scale=scale, points=1.0, optional=True, title=Text(en=scale))
    for link in construction.links:
        yield CriterionTable(id=link, link=link, points=0.5, optional=True, title=Text(en=link))
    for figure, rate in (("velocity_plan", "omega"), ("acceleration_plan", "epsilon")):
        for vector in construction.vectors_of(figure):
            yield _of_vector(mechanism, vector)
        for name in construction.rates:
            if name.startswith(f"{rate}_"):
                yield CriterionTable(id=name, angular=name, points=0.5, optional=True, title=Text(en=name))


def _of_vector(mechanism: Mechanism, vector: Vector) -> CriterionTable:
    """A vector about a joint of a plate's base is one of two ways to draw the plate's image: optional."""
    kind, about, *part = vector.name.split("_")
    title = Text(en=vector.name)
    plates = {group.node for group in mechanism.groups if isinstance(group, Plate)}
    if any(about.startswith(node) and about != node for node in plates):
        return CriterionTable(id=vector.name, vector=vector.name, points=0.5, optional=True, title=title)
    result = mechanism.groups[-1].node if mechanism.groups else mechanism.joints[-1]
    points = 3.0 if about == result and not part else POINTS[part[0] if part else kind]
    return CriterionTable(id=vector.name, vector=vector.name, points=points, title=title)
