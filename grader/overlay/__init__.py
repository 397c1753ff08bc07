"""Pictures of a drawing with the reading marked on it."""
