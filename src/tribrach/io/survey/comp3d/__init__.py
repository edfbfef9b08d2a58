"""Projects of IGN Comp3D."""
