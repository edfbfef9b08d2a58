"""Stations tied to each other: names of targets, planes and clouds, poses with their covariance."""
