"""How does one system lie in another? A transformation by common points, its tests, its use."""
