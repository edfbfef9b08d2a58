"""The core: survey by names, network by indices, adjustment, its quality and its errors."""
