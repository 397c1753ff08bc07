"""Where a sheet lies in its image: pixels to millimetres."""
