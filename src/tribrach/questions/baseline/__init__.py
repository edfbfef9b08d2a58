"""What is the vector between two receivers? A static baseline from RINEX files."""
