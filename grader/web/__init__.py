"""The web application of ``planmark serve``: self-check for students, classes for instructors."""
