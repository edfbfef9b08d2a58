"""A project or its results open before a person: look, switch off, see what moves."""
