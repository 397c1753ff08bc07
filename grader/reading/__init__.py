"""Identify the named vectors among strokes, with standard errors and confidences."""
