"""Instruments: their calibration models, noise and data sheets."""
