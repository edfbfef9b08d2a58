"""The steps of a design before measuring."""
