"""What are the errors of the scanner? Self-calibration from targets seen by several stations."""
