"""From the pixels of a scan to strokes in millimetres; the only room that sees images."""
