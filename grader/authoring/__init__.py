"""A new assignment to start from: three commented files that can be checked and drawn at once."""

from grader.authoring.create import New, new_assignment
from grader.authoring.starts import starts

__all__ = ["New", "new_assignment", "starts"]
