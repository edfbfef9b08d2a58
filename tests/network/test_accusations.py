"""Clean networks are not blamed, planted mistakes are named, and no innocent in their place.

The rates are those of method section 3.4. ``python -m tests.network.accusations`` prints tables of
any size.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from tests.network import accusations
from tests.network.accusations import RANDOM, Table, judged, random_network

#: accusations of which a clean network may have none, and those that are chance at 0.1 % a network
NEVER = (
    "exchanged", "circle", "circle less", "other face", "feet", "placeholder",
    "blunder looked for", "search given up", "unit or sign", "refused",
)  # fmt: skip
BY_CHANCE = ("common cause", "coordinate")


def within_rates(table: Table) -> None:
    """Counts of clean networks stay below what chance exceeds once in a hundred thousand."""
    total = sum(table.networks.values())
    text = "\n".join(table.lines())
    assert not [kind for kind in NEVER if table.accused[kind]], text
    for kind in BY_CHANCE:
        assert table.accused[kind] <= binom.isf(1e-5, total, 0.001), text
    # tests of one network are correlated: twice the spread of independent ones
    expected = table.tests / 1000
    assert table.beyond <= expected + 2 * 4.3 * np.sqrt(expected) + 3, text


@pytest.mark.parametrize("family", RANDOM)
def test_clean_networks_of_a_family_are_not_blamed(family: str) -> None:
    for seed in range(3):
        found = judged(random_network(family, np.random.default_rng(seed)))
        assert not [kind for kind in (*NEVER, *BY_CHANCE) if found.accused[kind]], found.texts


def test_planted_mistakes_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight of networks drawn at random."""
    monkeypatch.setattr(accusations, "existing", tuple)
    table = Table()
    for seed in range(8):
        table.planted(seed)
    assert sum(table.named.values()) >= 7, "\n".join(table.lines())
    assert sum(table.innocent.values()) == 0, "\n".join(table.lines())


@pytest.mark.slow
def test_2000_clean_networks() -> None:
    table = Table()
    for seed in range(2000):
        table.clean(seed)
    within_rates(table)


@pytest.mark.slow
def test_2000_planted_mistakes() -> None:
    table = Table()
    for seed in range(2000):
        table.planted(seed)
    text = "\n".join(table.lines())
    total = sum(table.networks.values())
    assert sum(table.named.values()) >= 0.95 * total, text
    # another mistake instead: the rate of clean networks, and what separability leaves
    assert sum(table.innocent.values()) <= binom.isf(1e-5, total, 0.005), text
    assert table.beyond <= table.tests / 1000 + 2 * 4.3 * np.sqrt(table.tests / 1000), text
