"""What was drawn, and what it is worth."""

__version__ = "0.1.0"
