"""The exact plan of a variant as a document, in words and as pages."""
