"""What printed targets have in common."""
