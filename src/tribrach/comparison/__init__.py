"""Clouds against clouds: distances, their floor, what was foretold, what drives them."""
