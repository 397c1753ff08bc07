"""Compare what was drawn with what is expected, criterion by criterion.

- `task`: what is asked: one variant's exact plan and the rubric
- `evidence`: readings and measurements in one frame, the assignment's
- `scales`: as declared, as the rule wants them, as the drawing shows them
- `own`: the student's own nodes
- `follow_through`: the expectations of a criterion: as given, as they follow, as explanations predict
- `verdicts`: one value held against one expectation
- `charges`: what earlier mistakes have cost, and the one choice among expectations
- `outcomes`: the outcome of a criterion as data
- `criteria`: all criteria, in the order of construction
"""
