"""An assignment and its rubric held against every variant, before students get it."""

from grader.lint.broken import broken_findings, broken_variants
from grader.lint.document import lint_document
from grader.lint.findings import LintFinding, Severity, named
from grader.lint.inspection import Least, Lint, Row, Worst, lint
from grader.lint.scales import Proposal, suggestions

__all__ = [
    "Least",
    "Lint",
    "LintFinding",
    "Proposal",
    "Row",
    "Severity",
    "Worst",
    "broken_findings",
    "broken_variants",
    "lint",
    "lint_document",
    "named",
    "suggestions",
]
