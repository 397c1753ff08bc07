"""A plan as it is drawn, step by step; evaluated, changed by a mistake, with drafting errors."""
