"""Readers of poses of scanners that stand in files beside the scans."""
