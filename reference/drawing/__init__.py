"""The parts of the reference drawing: figures with their symbols and letters, their place, the tables."""
