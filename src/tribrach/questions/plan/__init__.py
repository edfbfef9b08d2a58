"""What will a network reach before it is measured? Predicted figures, and what would help."""
