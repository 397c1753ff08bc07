"""Strokes to named vectors: what is drawn where, and how surely."""
