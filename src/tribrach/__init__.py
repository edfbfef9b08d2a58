"""Tribrach: one least-squares network for scans and survey observations."""

__version__ = "0.1.0"
