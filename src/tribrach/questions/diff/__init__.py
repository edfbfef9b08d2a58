"""What differs between two results of one job? Shifts with tests, sigmas, observations, edits."""
