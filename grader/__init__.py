"""The reading and marking of what students draw."""

__version__ = "0.1.0"
