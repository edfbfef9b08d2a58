"""What do differences of clouds depend on? Range and incidence, and whether they can be parted."""
