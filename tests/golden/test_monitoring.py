"""Cases of monitoring are as their golden files."""

from tests.golden import monitoring
from tests.golden.harness import frozen

test_as_before = frozen(monitoring.GROUPS)
