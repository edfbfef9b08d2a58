"""Scans on their way into the world: transformation in chunks, covariance of every point."""
