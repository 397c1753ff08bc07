"""A class in a folder: pages, owners, submissions, cache, workers."""
