"""From a comparison to points, named mistakes and a report."""
