"""Run time against error: the solver, the construction and the reading of sheets, measured."""
