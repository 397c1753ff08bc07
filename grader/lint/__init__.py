"""An assignment and its rubric held against every variant, before students get it."""
