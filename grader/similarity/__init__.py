"""Submissions of a class that are more alike than chance allows."""
