"""Benchmarks of run time and error: the solver, the construction and the reading of sheets."""
