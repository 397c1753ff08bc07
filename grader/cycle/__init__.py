"""A mechanism's cycle: named quantities and their table, extremes and strokes, a diagram."""
