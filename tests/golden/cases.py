"""All cases, by the test file that runs them."""

from tests.golden import clouds, instruments, monitoring, networks
from tests.golden.harness import Group

__all__ = ["FILES_OF_CASES"]

FILES_OF_CASES: dict[str, tuple[Group, ...]] = {
    module.__name__.rpartition(".")[2]: module.GROUPS
    for module in (networks, monitoring, instruments, clouds)
}
