"""Files that people write: one reader of tables, rosters, measurements, decisions; scales; the class file."""
