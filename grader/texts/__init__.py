"""Sentences: what people read of reasons and problems, in their language, made from codes and parameters."""
