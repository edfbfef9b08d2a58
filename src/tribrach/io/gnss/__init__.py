"""Files of GNSS: RINEX, orbits, solutions and vectors."""
