"""Whose data a drawing follows: what a student is given, and may not choose."""
