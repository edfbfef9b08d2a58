"""Printed discs."""
