"""What people write: rosters, measurements, scales."""
