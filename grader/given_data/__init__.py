"""The data that a drawing follows: those given to the student, or others."""
