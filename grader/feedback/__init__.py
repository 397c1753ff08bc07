"""What students and instructors read: sentences, a page per submission, an index of the class."""

from grader.feedback.class_page import write_index
from grader.feedback.leaflet import About
from grader.feedback.pages import write_feedback, write_leaflet
from grader.feedback.sentences import Level, criterion_feedback, mistake_feedback, reason_sentence
from grader.feedback.telling import with_mistakes_told

__all__ = [
    "About",
    "Level",
    "criterion_feedback",
    "mistake_feedback",
    "reason_sentence",
    "with_mistakes_told",
    "write_feedback",
    "write_index",
    "write_leaflet",
]
