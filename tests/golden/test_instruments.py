"""Cases of instruments are as their golden files."""

from tests.golden import instruments
from tests.golden.harness import frozen

test_as_before = frozen(instruments.GROUPS)
