"""Sentences about reasons and problems in the reader's language, made from codes and parameters."""
