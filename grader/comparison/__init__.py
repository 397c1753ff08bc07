"""What was drawn or measured against what is right: a verdict per criterion of the rubric.

`compare(task, submission)` is the whole of it. Each criterion is marked against the original data
at the student's scales first, then against what follows from the student's own earlier values; the
better counts. The mistake that later ones follow from costs once: where it was made, or, where no
criterion asks for that, at the first criterion that shows it. Small errors that are each within
their tolerance and add up in a later node are no mistake. Verdicts are `Outcome`s with structured
reasons (`grader.outcomes`); nothing here speaks a human language.

- `task`: the variant's exact plan and its rubric
- `evidence`: readings and measurements brought into one frame, the assignment's
- `limits`: one deviation against one tolerance, and what its standard error leaves open
- `scales`: declared scales against the rule, the drawn crank, v_A and a_A
- `marking`: one vector, value or scale against one expectation
- `following`: the expectations that a student's own earlier values give
- `ledger`: what earlier mistakes have cost, and what may follow through from them
- `criteria`: all criteria of a rubric, in the order of construction
"""

from grader.comparison.criteria import Comparison, compare
from grader.comparison.evidence import Submission
from grader.comparison.sketches import Sketch
from grader.comparison.task import Task, task_of

__all__ = ["Comparison", "Sketch", "Submission", "Task", "compare", "task_of"]
