"""Targets in scans: spheres, checkerboards, discs and planes, each with its covariance."""
