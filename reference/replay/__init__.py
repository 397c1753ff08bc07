"""Find what the student did: a construction compared with a drawing, step by step."""
