"""Clouds against clouds: distances, their sampling floor, what was predicted, what drives them."""
