"""Letters and numbers written by hand."""
