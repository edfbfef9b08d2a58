"""The core: unknowns, observations, datum, adjustment and its quality."""
