"""What was drawn held against what is expected, criterion by criterion.

- `task`: what is asked: one variant's exact plan and the rubric
- `evidence`: readings and measurements in one frame, the assignment's
- `scales`: as declared, as the rule wants them, as the drawing shows them
- `own`: the student's own nodes
- `follow_through`: what follows from them
- `verdicts`: one value against one expectation
- `charges`: what earlier mistakes have cost
- `criteria`: all criteria, in the order of construction
"""
