"""The construction of a plan step by step, in words and pictures, in the student's language."""

from grader.plan_steps.explanation import Explanation, Section, explain
from grader.plan_steps.pages import html_page, pdf_pages
from grader.plan_steps.redoing import redo
from grader.plan_steps.words import wording_of

__all__ = ["Explanation", "Section", "explain", "html_page", "pdf_pages", "redo", "wording_of"]
