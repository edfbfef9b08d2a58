"""Scans as they come from a scanner: points in chunks, fields, range images."""
