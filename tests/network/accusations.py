"""Counts false accusations and missed blunders over thousands of simulated networks.

    python -m tests.network.accusations --clean 2000 --planted 2000 [--batch 0] [--workers 1]

Clean networks are observed anew, with the stated covariances, at the adjusted places of networks
that exist (Gama's, where the files are there, and those of the twins) and of networks drawn at
random, weak ones among them. Every sentence that accuses is counted by its kind. In planted ones a
single mistake is made, and it is counted whether it is named, and whether an innocent is.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from time import perf_counter

import numpy as np

from tribrach.errors import TribrachError
from tribrach.geodesy.site import FlatSite
from tribrach.io.survey.formats import read
from tribrach.job.opened import open_job
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.network import Datum, Network, is_given
from tribrach.network.reliability import correlations_of_tests, weigh
from tribrach.network.significance import block_noncentrality, noncentrality
from tribrach.network.survey import Survey, observed_part
from tribrach.observations.base import Use
from tribrach.observations.declaration import End, StartTie
from tribrach.observations.gnss import GnssBaselines
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.scanner import Inclinations, TargetCentres
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.simulate.twins import TWINS, build
from tribrach.solution import AdjustmentSettings, SolvedNetwork, solve
from tribrach.units import SEC

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
#: larger networks are left out: a batch must not take hours
MOST = 320
#: families of random networks
RANDOM = ("polar", "free", "traverse", "levelling", "plan", "vectors", "far", "narrow")
#: planted mistakes, and how often each
PLANTED = ("reading",) * 5 + ("coordinate", "exchange", "quarter")
#: what an accusing sentence says, by the name of its kind
KINDS = {
    "exchanged": "are exchanged",
    "circle": "gon is added",
    "circle less": "gon is subtracted",
    "other face": "when they are taken from",
    "feet": "feet",
    "common cause": "in the way of one mistake",
    "coordinate": " wrong: ",
    "placeholder": "placeholders",
    "blunder looked for": "look for a blunder",
    "search given up": "gave up",
    "unit or sign": "another unit",
    "implausible sigma": "implausible",
}


# networks


def random_network(family: str, rng: np.random.Generator) -> Network:
    """A network of a family, its observations with the noise that their sigmas state."""
    survey = Survey(site=FlatSite())
    if family == "levelling":
        return _levelling(survey, rng)
    if family == "vectors":
        return _vectors(survey, rng)
    size = 60.0
    targets = int(rng.integers(4, 8))
    place = {f"T{i}": rng.uniform(-size, size, 3) * (1, 1, 0.15) for i in range(targets)}
    setup = {f"S{k}": rng.uniform(-size / 2, size / 2, 3) * (1, 1, 0.1) for k in range(3)}
    known = list(place)[: int(rng.integers(2, 5))]
    if family == "far":
        centre = np.array([*rng.normal(0, 700, 2), 0.0])
        place = {n: centre + rng.uniform(-0.5, 0.5, 3) for n in place}
        setup, known = {"S0": np.zeros(3)}, list(place)
    if family == "narrow":
        place = {n: x * (1.0, 0.02, 0.1) + (0, 150, 0) for n, x in place.items()}
        known = list(place)[:3]
    if family == "traverse":
        legs = int(rng.integers(4, 8))
        place = {f"T{i}": np.array([80.0 * i, rng.normal(0, 15), rng.normal(0, 3)])
                 for i in range(legs)}  # fmt: skip
        setup, known = {}, [f"T{i}" for i in (0, 1, legs - 2, legs - 1)]
    pairs = [(a, b) for a in setup for b in place] + [(a, b) for a in setup for b in setup if a < b]
    if family == "traverse":
        pairs = [(f"T{i}", f"T{j}") for i in range(legs) for j in (i - 1, i + 1) if 0 <= j < legs]
    sigma, metres = rng.uniform(1, 5) * SEC, rng.uniform(1, 4) * 1e-3
    given = 0.001 * rng.uniform(0.5, 3)
    if family == "free":
        known, survey.datum = [], Datum("free")
    for name in known:
        survey.point(
            name, place[name] + rng.normal(0, given, 3), covariance=given**2 * np.eye(3),
            role="control",
        )  # fmt: skip
    every = place | setup
    sight = np.array([every[b] - every[a] for a, b in pairs])
    e, n, u = sight.T
    flat, far = np.hypot(e, n), np.linalg.norm(sight, axis=1)
    ends = {"start": [a for a, _ in pairs], "end": [b for _, b in pairs]}
    ends["source"] = [f"sim.csv:{k + 2}" for k in range(len(pairs))]
    turn = {a: rng.uniform(0, 6) for a in every}
    hz = np.arctan2(e, n) - [turn[a] for a, _ in pairs] + sigma * rng.normal(size=len(e))
    survey.add(Directions, values=hz % (2 * np.pi), sigma=sigma, orientation=ends["start"], **ends)
    if family == "plan":
        flat = flat + metres * rng.normal(size=len(flat))
        survey.add(SlopeDistances, values=flat, sigma=metres, **ends)
        return _in_plan(survey, every, known)
    survey.add(
        ZenithAngles, values=np.arctan2(flat, u) + sigma * rng.normal(size=len(e)), sigma=sigma,
        **ends,
    )  # fmt: skip
    survey.add(SlopeDistances, values=far + metres * rng.normal(size=len(e)), sigma=metres, **ends)
    return survey.network()


def _in_plan(survey: Survey, places: dict[str, np.ndarray], known: list[str]) -> Network:
    """The observations in plan, at height zero, the known points held."""
    survey.points.clear()
    for name, place in places.items():
        held = name in known
        xyz = (*place[:2], 0.0) if held else (np.nan, np.nan, 0.0)
        role = "fixed" if held else "free"
        survey.point(name, xyz, free=(not held, not held, False), role=role)
    return survey.network()


def _levelling(survey: Survey, rng: np.random.Generator) -> Network:
    """Loops of height differences between three fixed heights and up to eight others."""
    count = int(rng.integers(5, 12))
    height = rng.uniform(0, 40, count)
    for i in range(3):
        survey.point(f"H{i}", (0.0, 0.0, height[i]), free=(False, False, False), role="fixed")
    for i in range(3, count):
        survey.point(f"H{i}", (0.0, 0.0, np.nan), free=(False, False, True))
    pairs = {(i, (i + 1) % count) for i in range(count)}
    while len(pairs) < 2 * count:
        i, j = rng.integers(0, count, 2)
        if i != j and (int(j), int(i)) not in pairs:
            pairs.add((int(i), int(j)))
    listed = sorted(pairs)
    rise = np.array([height[j] - height[i] for i, j in listed])
    sigma = rng.uniform(0.3, 2) * 1e-3
    survey.add(
        HeightDifferences, values=rise + sigma * rng.normal(size=len(rise)), sigma=sigma,
        start=[f"H{i}" for i, _ in listed], end=[f"H{j}" for _, j in listed],
    )  # fmt: skip
    return survey.network()


def _vectors(survey: Survey, rng: np.random.Generator) -> Network:
    """GNSS vectors between two given and up to six other points."""
    count = int(rng.integers(4, 8))
    place = rng.uniform(-2000, 2000, (count, 3)) * (1, 1, 0.05)
    for i in range(3):
        at = place[i] + rng.normal(0, 0.003, 3)
        survey.point(f"G{i}", at, covariance=9e-6 * np.eye(3), role="control")
    pairs = [(i, j) for i in range(count) for j in range(i) if rng.uniform() < 0.8 or j == i - 1]
    sigma = np.array([0.003, 0.003, 0.006])
    values = np.array([place[i] - place[j] for i, j in pairs]) + sigma * rng.normal(
        size=(len(pairs), 3)
    )
    survey.add(
        GnssBaselines, values=values, covariance=np.tile(np.diag(sigma**2), (len(pairs), 1, 1)),
        start=[f"G{j}" for _, j in pairs], end=[f"G{i}" for i, _ in pairs],
    )  # fmt: skip
    return survey.network()


@cache
def existing() -> tuple[tuple[str, Adjustment], ...]:
    """Gama's networks and those of the twins' surveys, adjusted, as far as they have redundancy."""
    out: list[tuple[str, Adjustment]] = []
    for path in sorted((DATA / "networks" / "gama").glob("*/*.gkf")):
        _keep(out, path.stem, lambda path=path: observed_part(read([path])).network())
    for name in TWINS:
        with tempfile.TemporaryDirectory() as folder:
            _keep(out, name, lambda name=name, folder=folder: _of_twin(name, Path(folder)))
    return tuple(out)


def _keep(out: list[tuple[str, Adjustment]], name: str, make: Callable[[], Network]) -> None:
    try:
        found = adjust(make())
    except TribrachError:
        return
    if found.dof > 1 and found.n_observations <= MOST:
        out.append((name, found))


def _of_twin(name: str, folder: Path) -> Network:
    """What the files of a twin say, and the targets that its stations see, eight of each."""
    made = build(name, 1000, 1)
    for file, text in made.files.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text(text)
    survey = Survey()
    if "[[observations]]" in made.project:
        project = made.project.split("[[comparison]]")[0] + '[[scans]]\nfile = "none.laz"\n'
        (folder / "project.toml").write_text(project)
        survey = open_job(folder / "project.toml").surveyed()
    else:
        survey.datum = Datum("free")
    targets = {t.name: t.center for t in made.targets}
    for station in made.stations:
        names = [n for n in made.visible(station.name) if n in targets][:8]
        seen = station.pose.inverse @ np.array([targets[n] for n in names])
        survey.station(station.name)
        survey.add(
            TargetCentres, values=seen, sigma=np.full(seen.shape, 0.0006),
            station=[station.name] * len(names), target=names,
        )  # fmt: skip
        survey.add(Inclinations, values=[[0.0, 0.0]], sigma=3 * SEC, station=[station.name])
    return observed_part(survey).network()


def observed_again(adjusted: Adjustment, rng: np.random.Generator) -> Network:
    """The network with new observations at its adjusted places, as its covariances state."""
    network, tables = adjusted.network, []
    for o in network.observations:
        root = np.linalg.cholesky(o.covariance)
        noise = np.einsum("nij,nj->ni", root, rng.standard_normal(o.values.shape))
        tables.append(o.predict(adjusted.state) + noise)
    for joint in network.joint:
        noise = np.linalg.cholesky(joint.covariance) @ rng.standard_normal(len(joint.table))
        for t, i, r, x in zip(joint.table, joint.item, joint.row, noise, strict=True):
            tables[t][i, r] = network.observations[t].predict(adjusted.state)[i, r] + x
    observations = tuple(
        replace(o, values=v) for o, v in zip(network.observations, tables, strict=True)
    )
    return replace(network, observations=observations)


def clean_network(seed: int) -> tuple[str, Network]:
    """One of all, the name of its family first."""
    rng = np.random.default_rng(seed)
    there = existing()
    pick = int(rng.integers(2 * len(RANDOM)))
    if pick < len(RANDOM) or not there:
        return RANDOM[pick % len(RANDOM)], random_network(RANDOM[pick % len(RANDOM)], rng)
    name, adjusted = there[int(rng.integers(len(there)))]
    return ("twin" if name in TWINS else "gama"), observed_again(adjusted, rng)


# what is said


@dataclass
class Verdict:
    """What the program says of one network."""

    accused: Counter[str] = field(default_factory=Counter)
    texts: list[str] = field(default_factory=list)
    solved: SolvedNetwork | None = None


def judged(network: Network, *, snoop: bool = True) -> Verdict:
    """Adjust, snoop, and count what is accused, by kind."""
    out = Verdict()
    try:
        out.solved = solve(network, AdjustmentSettings(snoop=snoop))
    except TribrachError as error:
        out.texts = [str(error)]
        out.accused["refused"] += 1
    else:
        warned = [w.text for w in out.solved.warnings]
        out.texts = [*warned, *out.solved.adjustment.warnings]
    for text in out.texts:
        for kind, words in KINDS.items():
            out.accused[kind] += words in text
    if out.solved is not None and out.solved.snooping is not None:
        for step in out.solved.snooping.steps:
            out.accused["switched off"] += step.action == "switched off"
            out.accused["switched off"] -= step.action == "taken back"
            out.accused["control suspicious"] += "suspicious" in step.action
    return out


@dataclass
class Table:
    """Counts over many networks."""

    networks: Counter[str] = field(default_factory=Counter)
    tests: int = 0
    beyond: int = 0
    failed: int = 0
    accused: Counter[str] = field(default_factory=Counter)
    examples: list[str] = field(default_factory=list)
    named: Counter[str] = field(default_factory=Counter)
    innocent: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0

    def clean(self, seed: int) -> None:
        """One clean network more."""
        family, network = clean_network(seed)
        verdict = judged(network)
        self.networks[family] += 1
        for kind, count in verdict.accused.items():
            if count > 0:
                self.accused[kind] += 1
                if kind not in ("switched off", "control suspicious"):
                    said = [t for t in verdict.texts if KINDS.get(kind, "") in t]
                    self.examples.append(f"seed {seed} {family}: {kind}: {said[:1]}")
        if verdict.solved is not None:
            try:
                first = adjust(network)
            except TribrachError:
                return
            w = weigh(first).w
            self.tests += int(np.isfinite(w).sum())
            self.beyond += int((np.abs(np.nan_to_num(w)) > 3.2905).sum())

    def planted(self, seed: int) -> None:
        """One network with a mistake more."""
        for attempt in range(50):
            rng = np.random.default_rng((seed, attempt))
            what = PLANTED[int(rng.integers(len(PLANTED)))]
            family, network = clean_network(int(rng.integers(1 << 40)))
            made = _planted(what, network, rng)
            if made is not None:
                break
        else:
            return
        changed, is_named, may_be_named = made
        verdict = judged(changed)
        words = list(verdict.texts)
        steps = (
            ()
            if verdict.solved is None
            else (() if verdict.solved.snooping is None else verdict.solved.snooping.steps)
        )
        off = [s for s in steps if s.action == "switched off" or "suspicious" in s.action]
        back = {s.observation for s in steps if s.action == "taken back"}
        off = [s for s in off if s.observation not in back]
        words += [s.observation + " " + " ".join(s.alternatives) for s in off]
        self.networks[what] += 1
        good = is_named(words)
        self.named[what] += good
        if not good:
            self.examples.append(f"missed, seed {seed} {family} {what}: {words[-3:]}")
        guilty = [s for s in off if not may_be_named(s.observation)
                  and not any(may_be_named(a) for a in s.alternatives)]  # fmt: skip
        slips = [t for t in verdict.texts if not may_be_named(t)
                 and any(KINDS[k] in t for k in KINDS if k != "search given up")]  # fmt: skip
        self.tests += changed.count()
        self.beyond += len(guilty)
        self.innocent[what] += bool(slips)
        if guilty or slips:
            self.examples.append(
                f"innocent, seed {seed} {family} {what}: "
                f"{[s.observation for s in guilty][:2]} {slips[:1]}"
            )

    def lines(self) -> Iterator[str]:
        """The table."""
        total = sum(self.networks.values())
        yield f"{total} networks in {self.seconds:.0f} s: {dict(self.networks)}"
        if self.tests:
            what = "innocent observations switched off" if self.named else "tests beyond 3.29"
            yield f"{what}: {self.beyond} of {self.tests}, {self.tests / 1000:.0f} expected"
        for kind in sorted(self.accused):
            yield f"  {kind:22s} {self.accused[kind]:5d} networks, {self.accused[kind] / total:.2%}"
        for what in dict.fromkeys(PLANTED) if self.named else ():
            if self.networks[what]:
                n = self.networks[what]
                yield (
                    f"  {what:12s} {n:5d} planted, {self.named[what] / n:7.2%} named, "
                    f"{self.innocent[what]:3d} with another mistake named"
                )
        yield from self.examples[:60]


Named = Callable[[list[str]], bool]
Allowed = Callable[[str], bool]


def _planted(
    what: str, network: Network, rng: np.random.Generator
) -> tuple[Network, Named, Allowed] | None:
    """The network with one mistake, what names it, and which words may speak of it."""
    if what == "reading":
        return _reading(network, rng)
    if what == "coordinate":
        return _coordinate(network, rng)
    if what == "exchange":
        return _exchange(network, rng)
    return _quarter(network, rng)


def _reading(network: Network, rng: np.random.Generator) -> tuple[Network, Named, Allowed] | None:
    """One value of one to three times its minimal detectable bias."""
    try:
        first = adjust(network)
    except TribrachError:
        return None
    system = weigh(first)
    share = np.where(system.controlled, system.s / system.weight, 0.0)
    given = np.array([is_given(type(o), o.group) for o in network.observations])
    rows = np.flatnonzero((share > 0.1) & ~given[first.rows.table])
    if not len(rows):
        return None
    row = int(rng.choice(rows))
    table, item = int(first.rows.table[row]), int(first.rows.item[row])
    o = network.observations[table]
    delta = noncentrality() if o.rows == 1 else block_noncentrality(o.rows)
    size = rng.uniform(1, 3) * delta / np.sqrt(system.s[row]) * rng.choice([-1, 1])
    values = o.values.copy()
    values[item, first.rows.row[row]] += size
    guilty = Network.describe(o, item, first.state)
    rho = np.nan_to_num(correlations_of_tests(system, np.array([row]))[:, 0])
    alike = {guilty}
    for k in np.flatnonzero(np.abs(rho) > 0.7):
        t = int(first.rows.table[k])
        alike.add(Network.describe(network.observations[t], int(first.rows.item[k]), first.state))
    changed = _with_values(network, table, values)
    return changed, lambda ws: any(guilty in w for w in ws), lambda w: any(a in w for a in alike)


def _with_values(network: Network, table: int, values: np.ndarray) -> Network:
    observations = list(network.observations)
    observations[table] = replace(observations[table], values=values)
    return replace(network, observations=tuple(observations))


def _coordinate(
    network: Network, rng: np.random.Generator
) -> tuple[Network, Named, Allowed] | None:
    """One coordinate of control off by decimetres or metres, where the rest checks it."""
    try:
        first = adjust(network)
    except TribrachError:
        return None
    system = weigh(first)
    share = np.where(system.controlled, system.s / system.weight, 0.0)
    given = np.array([is_given(type(o), o.group) for o in network.observations])
    rows = np.flatnonzero((share > 0.2) & given[first.rows.table])
    # two points cannot say which of them is wrong
    if len({int(first.rows.item[r]) for r in rows}) < 4:
        return None
    row = int(rng.choice(rows))
    table, item = int(first.rows.table[row]), int(first.rows.item[row])
    o = network.observations[table]
    values = o.values.copy()
    bias = noncentrality() / np.sqrt(system.s[row])
    values[item, first.rows.row[row]] += rng.choice([-1, 1]) * bias * rng.uniform(2, 30)
    name = o.ends(first.layout)[item][0]
    changed = _with_values(network, table, values)
    return changed, lambda ws: any(name in w for w in ws), lambda w: name in w


def _sights(network: Network) -> dict[str, dict[str, list[tuple[int, int]]]]:
    """Observations (table, item) by set-up and target."""
    out: dict[str, dict[str, list[tuple[int, int]]]] = {}
    layout = network.start.layout
    for table, o in enumerate(network.observations):
        start, end = o.end_field(End.FROM), o.end_field(End.TO)
        if not o.facts.names_target or start is None or end is None:
            continue
        if start.family != "position" or o.facts.start is StartTie.NONE:
            continue
        for item in np.flatnonzero(o.use == Use.ACTIVE):
            a, b = o.ends(layout)[item]
            if not layout.has("point", b):
                continue
            out.setdefault(a, {}).setdefault(b, []).append((table, int(item)))
    return out


def _exchange(network: Network, rng: np.random.Generator) -> tuple[Network, Named, Allowed] | None:
    """Two names exchanged at a set-up that sees four others at least; three set-ups see them."""
    sights = _sights(network)
    seen = Counter(t for targets in sights.values() for t in targets)
    try:
        first = adjust(network)
    except TribrachError:
        return None
    layout = network.start.layout
    options = [
        (s, p, q)
        for s, targets in sights.items()
        if len(targets) >= 5
        for p in targets
        for q in targets
        if p < q and seen[p] >= 3 and seen[q] >= 3
        and np.linalg.norm(first.points[p].xyz - first.points[q].xyz) > 2.0
    ]  # fmt: skip
    if not options:
        return None
    s, p, q = options[int(rng.integers(len(options)))]
    observations = list(network.observations)
    swap = {layout.index("point", p): layout.index("point", q)}
    swap |= {b: a for a, b in swap.items()}
    for table, item in sights[s][p] + sights[s][q]:
        o = observations[table]
        end = o.end_field(End.TO)
        assert end is not None
        column = np.array(getattr(o, end.name)).copy()
        column[item] = swap[int(column[item])]
        observations[table] = replace(o, **{end.name: column})
    changed = replace(network, observations=tuple(observations))

    def is_named(words: list[str]) -> bool:
        return any("are exchanged" in w and p in w and q in w and s in w for w in words)

    return changed, is_named, lambda w: p in w or q in w or "placeholder" in w


def _quarter(network: Network, rng: np.random.Generator) -> tuple[Network, Named, Allowed] | None:
    """One or two directions of a set-up off by 100, 200 or 300 gon."""
    sights = _sights(network)
    seen = Counter(t for targets in sights.values() for t in targets)
    options = [
        (s, [k for t in targets if seen[t] >= 3 for k in targets[t]
             if network.observations[k[0]].kind == "direction"])
        for s, targets in sights.items()
        if len(targets) >= 5
    ]  # fmt: skip
    options = [(s, keys) for s, keys in options if len(keys) >= 5]
    if not options:
        return None
    _, keys = options[int(rng.integers(len(options)))]
    count = int(rng.integers(1, 3))
    chosen = [keys[int(i)] for i in rng.choice(len(keys), count, replace=False)]
    turn = int(rng.integers(1, 4)) * np.pi / 2
    changed = network
    names = []
    for table, item in chosen:
        o = changed.observations[table]
        values = o.values.copy()
        values[item, 0] = (values[item, 0] + turn) % (2 * np.pi)
        names.append(Network.describe(o, item, network.start).removeprefix("direction "))
        changed = _with_values(changed, table, values)
    gon = f"{400 - round(turn / np.pi * 200)} gon is added"

    def is_named(words: list[str]) -> bool:
        text = " ".join(words)
        return gon in text and all(n in text for n in names)

    def allowed(words: str) -> bool:
        return any(n in words for n in names)

    return changed, is_named, allowed


def main() -> None:
    """Count, and print two tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clean", type=int, default=200)
    parser.add_argument("--planted", type=int, default=200)
    parser.add_argument("--batch", type=int, default=0, help="another one draws other networks")
    chosen = parser.parse_args()
    for count, what in ((chosen.clean, "clean"), (chosen.planted, "planted")):
        table, begun = Table(), perf_counter()
        for k in range(count):
            getattr(table, what)(10_000_000 * chosen.batch + k)
        table.seconds = perf_counter() - begun
        print(f"== {what}", *table.lines(), sep="\n", flush=True)


if __name__ == "__main__":
    main()
