"""Cases of files of scans and of clouds are as their golden files."""

from tests.golden import clouds
from tests.golden.harness import frozen

test_as_before = frozen(clouds.OF_CLOUDS)
