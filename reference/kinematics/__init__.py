"""Positions, velocities and accelerations of a mechanism, solved to the last digits."""
