"""Raw files of total stations, one module for each format, all into one model of columns."""
