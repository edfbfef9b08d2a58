"""Start values of all unknowns, found from the observations."""
