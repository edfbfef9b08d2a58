"""Questions, each a room: its result, how it is computed, its chapters, its command."""
