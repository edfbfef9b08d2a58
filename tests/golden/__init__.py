"""What every command says and writes, frozen: `python -m tests.golden --help`."""
