"""Spherical targets."""
