"""Simulated scans and survey observations, with the truth they were drawn from."""
