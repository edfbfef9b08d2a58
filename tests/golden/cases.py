"""All cases, by the test file that runs them."""

from tests.golden import networks
from tests.golden.harness import Group

__all__ = ["FILES_OF_CASES"]

FILES_OF_CASES: dict[str, tuple[Group, ...]] = {"networks": networks.GROUPS}
