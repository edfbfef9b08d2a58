"""Scanners, scenes and whole surveys, simulated with their truth."""
