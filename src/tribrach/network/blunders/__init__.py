"""Gross errors: what they look like, where they are, estimates that bear them."""
