"""Texts for students and instructors: sentences, a page per submission, an index of the class."""
