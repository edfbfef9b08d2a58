"""Sealed jobs: what was measured and what came of it in one file that others can verify."""
