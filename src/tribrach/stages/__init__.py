"""The steps of a run that remember what they have done, so that work goes on where it stopped."""
