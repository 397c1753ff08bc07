"""A student's own check of values or a photo: right, off or open, and the answer not given away."""
