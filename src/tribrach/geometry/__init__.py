"""Rotations, polar coordinates and closed-form alignment, all array-shaped."""
