"""STAR*NET: data files and the settings of their project."""
