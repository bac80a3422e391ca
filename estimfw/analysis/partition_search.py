"""The two searches for the best partition: all of them, and greedy with exchanges."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Self

import numpy as np
from numpy.typing import NDArray

__all__ = ["Atoms", "Ranked", "all_partitions", "exchanged", "greedy_partition"]

FloatArray = NDArray[np.float64]
Groups = list[list[int]]

#: A J that is larger by less than this is a rounding: the first one found is kept.
SAME = 1e-12

#: More atoms than this are too many for an exact search, whatever the sizes.
MOST_ATOMS = 64

#: Orders of unequal sizes that the greedy search tries.
MOST_ORDERS = 24


@dataclass(frozen=True)
class Atoms:
    """What cannot be cut: seeds, and single states, in the order of their first states.

    Attributes
    ----------
    members : tuple of tuple of int
        States of each.
    weights : (atoms, atoms) array
        Sums over their states; zero on the diagonal.
    seeded : (atoms,) array of bool
        Which are seeds.
    """

    members: tuple[tuple[int, ...], ...]
    weights: FloatArray
    seeded: NDArray[np.bool_]

    @classmethod
    def of(cls, weights: FloatArray, seeds: Sequence[Sequence[int]]) -> Self:
        """Seeds share no state."""
        own = {i for seed in seeds for i in seed}
        singles = [(i,) for i in range(len(weights)) if i not in own]
        members = sorted([*(tuple(sorted(s)) for s in seeds), *singles])
        pick = np.zeros((len(members), len(weights)))
        for a, states in enumerate(members):
            pick[a, list(states)] = 1.0
        between = pick @ weights @ pick.T
        np.fill_diagonal(between, 0.0)
        return cls(tuple(members), between, np.array([m[0] in own for m in members], dtype=bool))

    def __len__(self) -> int:
        return len(self.members)

    @property
    def sizes(self) -> NDArray[np.int64]:
        return np.array([len(m) for m in self.members], dtype=np.int64)

    def value(self, groups: Groups) -> float:
        """J of groups of atoms, without what is inside of atoms: that is the same for all partitions."""
        return float(sum(self.weights[np.ix_(g, g)].sum() / 2.0 for g in groups))

    def states(self, groups: Groups) -> tuple[tuple[int, ...], ...]:
        """Groups of states, in the order of their first ones."""
        return tuple(sorted(tuple(sorted(i for a in g for i in self.members[a])) for g in groups))


@dataclass(frozen=True, slots=True)
class Ranked:
    """The best groups of atoms and the next best, None where there are none; of how many cases."""

    best: Groups | None
    second: Groups | None
    cases: int


class _TooManyError(Exception):
    """The search would not end soon."""


class _All:
    """Atoms go into groups one after the other, each into every one that has room: in lexicographic order of the groups."""

    def __init__(self, atoms: Atoms, sizes: Sequence[int], most: int) -> None:
        self.atoms, self.most = atoms, most
        self.weights, self.sizes, self.seeded = atoms.weights.tolist(), atoms.sizes.tolist(), atoms.seeded.tolist()
        self.closed = list(sizes)  # sizes of groups that nothing is in yet
        self.groups: Groups = []
        self.room: list[int] = []
        self.seeds: list[int] = []
        self.apart, self.each = atoms.seeded.sum() <= len(sizes), atoms.seeded.sum() >= len(sizes)
        self.branches, self.cases = 0, 0
        self.kept: list[tuple[float, Groups]] = []

    def put(self, atom: int, value: float, seeds_left: int) -> None:
        self.branches += 1
        if self.branches > self.most:
            raise _TooManyError
        if self.each and self.seeds.count(0) + len(self.closed) > seeds_left:
            return
        if atom == len(self.sizes):
            self.keep(value)
            return
        seed, row = self.seeded[atom], self.weights[atom]
        for g in range(len(self.groups)):
            if self.room[g] >= self.sizes[atom] and not (seed and self.apart and self.seeds[g]):
                gain = sum([row[b] for b in self.groups[g]])
                self.enter(g, atom, value + gain, seeds_left)
        for size in sorted(set(self.closed), reverse=True):
            if size >= self.sizes[atom]:
                self.closed.remove(size)
                self.groups.append([])
                self.room.append(size)
                self.seeds.append(0)
                self.enter(len(self.groups) - 1, atom, value, seeds_left)
                self.groups.pop(), self.room.pop(), self.seeds.pop()
                self.closed.append(size)

    def enter(self, group: int, atom: int, value: float, seeds_left: int) -> None:
        """Go on with the atom in the group, and take it out again."""
        seed = int(self.seeded[atom])
        self.groups[group].append(atom)
        self.room[group] -= self.sizes[atom]
        self.seeds[group] += seed
        self.put(atom + 1, value, seeds_left - seed)
        self.groups[group].pop()
        self.room[group] += self.sizes[atom]
        self.seeds[group] -= seed

    def keep(self, value: float) -> None:
        """The two best; of equal ones the first."""
        self.cases += 1
        better = sum(value > one + SAME for one, _ in self.kept)
        if len(self.kept) < 2 or better:
            self.kept.insert(len(self.kept) - better, (value, [list(g) for g in self.groups]))
            del self.kept[2:]


def all_partitions(atoms: Atoms, sizes: Sequence[int], most: int) -> Ranked | None:
    """Compare every partition; None where there are more than ``most`` branches to look at."""
    if len(atoms) > MOST_ATOMS:
        return None
    search = _All(atoms, sizes, most)
    try:
        search.put(0, 0.0, int(atoms.seeded.sum()))
    except _TooManyError:
        return None
    found = [groups for _, groups in search.kept] + [None, None]
    return Ranked(found[0], found[1], search.cases)


def greedy_partition(atoms: Atoms, sizes: Sequence[int]) -> Ranked:
    """Groups filled by what fits best, and cut along a line, then pairs exchanged while that raises J.

    The second best is one exchange away.
    """
    best: Groups | None = None
    for order in islice(_orders(tuple(sizes)), MOST_ORDERS):
        for start in (_filled(atoms, order), _along_slowest(atoms, order)):
            if start is not None:
                made = exchanged(atoms, start)
                best = made if best is None or atoms.value(made) > atoms.value(best) + SAME else best
    second = _best_exchange(atoms, best) if best is not None else None
    return Ranked(best, second.groups if second is not None else None, 0)


def _orders(sizes: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """All different orders of the sizes, the given one first."""
    if not sizes:
        yield ()
    for size in dict.fromkeys(sizes):
        at = sizes.index(size)
        for rest in _orders(sizes[:at] + sizes[at + 1 :]):
            yield (size, *rest)


def _filled(atoms: Atoms, sizes: Sequence[int]) -> Groups | None:
    """Seeds first, then again and again the atom and the group with room that are tied most closely; None: they do not fit."""
    groups: Groups = [[] for _ in sizes]
    room = np.array(sizes, dtype=np.int64)
    tie = np.zeros((len(atoms), len(sizes)))
    free = np.ones(len(atoms), dtype=bool)

    def put(atom: int, group: int) -> None:
        groups[group].append(atom)
        room[group] -= atoms.sizes[atom]
        tie[:, group] += atoms.weights[atom]
        free[atom] = False

    for group, seed in enumerate(_first_seeds(atoms, len(sizes))):
        if room[group] < atoms.sizes[seed]:
            return None
        put(seed, group)
    while free.any():
        large = free & (atoms.sizes == atoms.sizes[free].max())  # the bulky ones while there is room
        fits = large[:, None] & (room >= atoms.sizes[:, None])
        if not fits.any():
            return None
        put(*_first_largest(np.where(fits, tie, -np.inf)))
    return groups


def _along_slowest(atoms: Atoms, sizes: Sequence[int]) -> Groups | None:
    """Atoms in the order of the slowest mode of their ties, cut into groups: chains are cut across; None: that does not fit.

    M. Fiedler, "Algebraic connectivity of graphs", Czechoslovak Mathematical Journal 23 (1973) 298.
    """
    if len(atoms) < 2:
        return None
    strength = atoms.weights.sum(axis=1)
    scale = np.divide(1.0, np.sqrt(strength), out=np.zeros_like(strength), where=strength > 0.0)
    mode = scale * np.linalg.eigh(np.eye(len(atoms)) - atoms.weights * scale[:, None] * scale)[1][:, 1]
    mode = mode * np.sign(mode[np.argmax(np.abs(mode))])
    groups: Groups = [[]]
    for atom in np.argsort(-mode, kind="stable").tolist():
        if sum(atoms.sizes[groups[-1]]) == sizes[len(groups) - 1]:
            groups.append([])
        groups[-1].append(atom)
        if sum(atoms.sizes[groups[-1]]) > sizes[len(groups) - 1]:
            return None
    seeds = [int(atoms.seeded[g].sum()) for g in groups]
    fits = max(seeds) <= 1 if sum(seeds) <= len(sizes) else min(seeds) >= 1
    return groups if fits else None


def _first_seeds(atoms: Atoms, groups: int) -> list[int]:
    """All seeds where there are no more than groups; else so many that are tied least to each other."""
    seeds = np.flatnonzero(atoms.seeded).tolist()
    if len(seeds) <= groups:
        return seeds
    chosen = seeds[:1]
    while len(chosen) < groups:
        left = [s for s in seeds if s not in chosen]
        nearest = atoms.weights[np.ix_(left, chosen)].max(axis=1)
        chosen.append(left[int(np.argmin(nearest))])
    return chosen


def exchanged(atoms: Atoms, groups: Groups) -> Groups:
    """The best exchange of two atoms of equal size, again and again until none raises J."""
    while (found := _best_exchange(atoms, groups)) is not None and found.gain > SAME:
        groups = found.groups
    return groups


@dataclass(frozen=True, slots=True)
class _Exchange:
    gain: float
    groups: Groups


def _best_exchange(atoms: Atoms, groups: Groups) -> _Exchange | None:
    """No group loses its only seed to a state that is none; None where nothing can be exchanged."""
    group, sizes, seeded = np.empty(len(atoms), dtype=np.int64), atoms.sizes, atoms.seeded
    for g, own in enumerate(groups):
        group[own] = g
    tie = np.stack([atoms.weights[:, own].sum(axis=1) for own in groups], axis=1)
    there = tie[:, group]  # of atom i to the group of atom j
    stays = np.diag(there)
    gain = there + there.T - stays[:, None] - stays - 2.0 * atoms.weights
    several = np.array([seeded[own].sum() > 1 for own in groups])[group] & seeded
    alike = (seeded[:, None] == seeded) | several[:, None] | several
    allowed = (group[:, None] < group) & (sizes[:, None] == sizes) & alike
    if not allowed.any():
        return None
    i, j = _first_largest(np.where(allowed, gain, -np.inf))
    swapped = {i: j, j: i}
    return _Exchange(float(gain[i, j]), [[swapped.get(a, a) for a in own] for own in groups])


def _first_largest(values: FloatArray) -> tuple[int, int]:
    """Row and column of the largest value; of equal ones the first."""
    at = np.argwhere(values >= values.max() - SAME)[0]
    return int(at[0]), int(at[1])
