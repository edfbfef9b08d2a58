"""The observation kinds, one file for each family, and the unknowns that they refer to."""
