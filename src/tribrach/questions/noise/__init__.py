"""How much noise does the scanner have? Laws from planes in its own scans."""
