"""The review of a class on a web page: a person decides open questions one after the other."""
