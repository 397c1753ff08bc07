"""From the pixels of a scan to strokes in millimetres; the only room that sees images.

In the order of the work: `decode`, `register`, `strokes`, `handwriting`; `pixels` serves them all.
"""
