"""What a perfect student draws: exact plane kinematics and its graphical construction."""
