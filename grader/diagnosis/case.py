"""What there is to explain."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from reference.assignment import Assignment, Variant
from reference.hand import Skill
from reference.mistakes import Drawing
from reference.replay import Work


@dataclass(frozen=True, slots=True)
class Case:
    """A drawing to explain.

    Attributes
    ----------
    drawing : how it should have been drawn, at the scales declared
    work : what was drawn
    lost : the vectors that lost points, or may lose some, with their criteria
    assignment, variant : whose plan it should be
    skill : of a usual hand
    followed : scales that the drawing follows although others were declared
    assumed : scales that nobody declared
    scale_criteria : the criterion of each scale that lost
    """

    drawing: Drawing
    work: Work
    lost: Mapping[str, str]
    assignment: Assignment
    variant: Variant
    skill: Skill
    followed: Mapping[str, float] = field(default_factory=dict)
    assumed: frozenset[str] = frozenset()
    scale_criteria: Mapping[str, str] = field(default_factory=dict)
