"""What was drawn held against what is expected, criterion by criterion."""
