"""A student's own check of values or a photo: right, off or open, without giving the answer away."""
