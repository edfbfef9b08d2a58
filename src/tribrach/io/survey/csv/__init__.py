"""Tribrach's own tables of points and observations."""
