"""Stations tied by natural planes."""
