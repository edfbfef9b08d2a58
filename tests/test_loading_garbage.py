"""Loading the modules of a command looks for no garbage, and the command itself does."""

from __future__ import annotations

import subprocess
import sys

_COUNTED = """
import gc, sys
rounds = []
gc.callbacks.append(lambda phase, info: rounds.append(gc.get_freeze_count()))
from tribrach.cli import main
rounds.clear()
sys.argv = ["tribrach", "adjust", "--help"]
try:
    main()
except SystemExit:
    pass
print(gc.isenabled(), gc.get_freeze_count() > 10_000, 0 in rounds, file=sys.stderr)
"""


def test_modules_are_kept_and_collection_goes_on() -> None:
    words = [sys.executable, "-c", _COUNTED]
    told = subprocess.run(words, capture_output=True, text=True, check=True).stderr
    # on again, what was loaded is set aside, and no round took place before that
    assert told.split() == ["True", "True", "False"]
