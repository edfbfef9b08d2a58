"""Work in tasks that know nothing of each other, done in this process or by others."""
