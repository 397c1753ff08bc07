"""Files that authors write: mechanisms, assignments, formulas."""
