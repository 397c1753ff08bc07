"""A plan as it is drawn: directions, lengths, intersections; evaluated, changed by a mistake, with drafting errors."""
