"""Which detection is which target, and where stations roughly stand."""
