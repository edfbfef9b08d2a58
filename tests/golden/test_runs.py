"""Cases of runs, their pages and the workbench are as their golden files."""

from tests.golden import clouds
from tests.golden.harness import frozen

test_as_before = frozen(clouds.OF_RUNS)
