"""From one coordinate system into another by common points: models, weighted fits, their tests."""
