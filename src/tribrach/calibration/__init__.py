"""Calibrating scanners: self-calibration in the network, what is estimable, checks in the field."""
