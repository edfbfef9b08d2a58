"""Models of surfaces: meshes, terrain grids, surfaces of drawings."""
