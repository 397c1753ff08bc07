"""A plan as it is drawn, step by step; evaluated, changed by a mistake, with drafting errors.

Read first `graph`: the construction and its one evaluator, with a worked four-bar.

- `elements`: directions, lengths and lines, as a step sees them
- `steps`: what makes one node from earlier nodes
- `graph`: the construction, evaluated
- `derive`: a mechanism's construction; each of its parts writes down its own (`groups`) in a `draft`
- `mistakes`: one step or parameter changed, the rest followed through
- `uncertainty`: how far drafting errors move each node, and so the tolerance
"""
