"""Pictures of a drawing with what was read on it."""
