"""An open benchmark of stated uncertainty of registered scans: see README.md here."""
