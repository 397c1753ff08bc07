"""What students and instructors read: sentences, a page per submission, an index of the class."""
