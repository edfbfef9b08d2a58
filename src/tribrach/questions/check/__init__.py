"""Is the scanner in order? Faces, distances, series and known lengths, tested in the field."""
