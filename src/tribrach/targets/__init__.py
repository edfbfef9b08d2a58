"""Targets: which of them are the same in several stations and in the control."""
