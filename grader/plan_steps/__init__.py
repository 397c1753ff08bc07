"""The construction of a plan step by step, in words and pictures, in the student's language."""
