"""Single handwritten signs: which there may be on a drawing, and what is written in a box."""

from grader.letters.boxes import written_lengths, written_scales
from grader.letters.sheet_letters import find_letters

__all__ = ["find_letters", "written_lengths", "written_scales"]
