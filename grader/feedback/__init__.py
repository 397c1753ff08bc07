"""What students and instructors read: sentences, a page per submission, an index of the class."""

from grader.feedback.class_page import write_index
from grader.feedback.pages import write_feedback
from grader.feedback.sentences import Level, criterion_feedback, mistake_feedback, reason_sentence

__all__ = [
    "Level",
    "criterion_feedback",
    "mistake_feedback",
    "reason_sentence",
    "write_feedback",
    "write_index",
]
