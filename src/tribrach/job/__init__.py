"""One opened project and its steps."""
