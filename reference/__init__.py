"""Exact plane kinematics and its graphical construction: the plans of a perfect student."""
