"""Design before measuring: predicted precision and reliability, and what would improve them."""
