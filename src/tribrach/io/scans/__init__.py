"""Readers of scans, one file per format; `formats.read_scans` finds the right one."""
