"""What do the points of a monitored network do through time? All cycles in one call."""
