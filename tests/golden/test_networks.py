"""Cases of networks are as their golden files."""

from tests.golden import networks
from tests.golden.harness import frozen

test_as_before = frozen(networks.GROUPS)
