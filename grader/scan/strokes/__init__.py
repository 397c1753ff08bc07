"""The ink of a sheet: strokes, arrowheads, circles, hatching."""
