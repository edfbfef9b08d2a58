"""Speed and memory as ratios to a peer: ``python -m benchmarks``."""
