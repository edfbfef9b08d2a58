"""Writers of clouds, one file per format; `formats.create` finds the right one."""
