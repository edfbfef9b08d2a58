"""``python -m tribrach`` is the command ``tribrach``."""

from tribrach.cli import main

if __name__ == "__main__":
    main()
