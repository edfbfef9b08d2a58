"""Readers of survey observations, one module per format."""
