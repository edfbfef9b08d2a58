"""Projects of RIEGL RiSCAN PRO."""
