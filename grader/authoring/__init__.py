"""Assignments as authors write them: new files, lint, round scales, the table of all variants."""
