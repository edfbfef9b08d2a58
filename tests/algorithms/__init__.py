"""Valid but degenerate inputs for every command: ``python -m tests.algorithms --cases 10000``."""
