"""The parts of the reference drawing: figures with their symbols and letters, the layout, the tables."""
