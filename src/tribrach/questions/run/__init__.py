"""What a run of a project leaves in its folder."""
