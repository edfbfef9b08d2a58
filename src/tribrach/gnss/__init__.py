"""GNSS before the adjustment: RINEX files, baselines of an engine, sessions, loops."""
