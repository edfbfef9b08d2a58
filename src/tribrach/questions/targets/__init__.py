"""Which targets are in a scan? Spheres, checkerboards and discs, with what was refused."""
