"""Checkerboard targets."""
