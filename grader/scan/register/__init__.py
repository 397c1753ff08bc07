"""Register a sheet in its image: pixels to millimetres."""
