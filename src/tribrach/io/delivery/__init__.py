"""Results in the formats of offices: drawings, survey exchange, layers of a GIS, lists, sheets."""
