"""What was done: a construction held against a drawing, step by step."""
