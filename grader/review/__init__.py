"""The review of a class on a web page: a person settles what waits, one question after the other."""
