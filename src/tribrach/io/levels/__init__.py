"""Files of digital levels: staff readings with their distances, set-up by set-up."""
