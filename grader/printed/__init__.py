"""What planmark prints: answer sheets, their markers, zones and cells."""
