"""Image and PDF files to pages of grey pixels, within limits."""
