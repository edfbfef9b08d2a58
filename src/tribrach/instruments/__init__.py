"""Instruments: calibration models, noise, and the reduction of raw readings."""
