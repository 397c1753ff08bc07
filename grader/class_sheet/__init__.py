"""All variants of an assignment for the instructor's own records: a table, and pages to print."""

from grader.class_sheet.columns import Column, Section, class_csv, sections_of
from grader.class_sheet.pages import Page, Tell, class_pages, numbered, table_pages

__all__ = [
    "Column",
    "Page",
    "Section",
    "Tell",
    "class_csv",
    "class_pages",
    "numbered",
    "sections_of",
    "table_pages",
]
