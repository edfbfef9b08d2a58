"""Simulated observations of any network, with truth."""
