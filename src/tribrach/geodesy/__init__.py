"""The work frame and its relation to the Earth: verticals, heights, coordinate systems."""
