"""One file per observation kind; see ``base`` for what a kind is."""
