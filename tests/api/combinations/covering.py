"""Covering arrays: few rows in which every pair of levels of any two factors occurs, or every triple of three.

The algorithm is greedy like AETG (Cohen et al., IEEE Transactions on Software Engineering 23(7), 1997). Each row begins
with levels that no row combines yet, and takes the level of each other factor that covers the most new combinations.
"""

from __future__ import annotations

from itertools import combinations, islice, permutations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    Row = dict[str, str]
    """A level of each factor that is there, by its name."""


class Factor(NamedTuple):
    """Something of a request that has levels.

    Attributes:
        name: Name of the factor.
        levels: Names of its levels.
        needs: Condition for the factor to exist: earlier factors, each with the levels that it must have.
        group: Group of the factor; all triples of levels inside a group occur beside plain levels of all others.
    """

    name: str
    levels: Sequence[str]
    needs: Mapping[str, Collection[str]] = {}
    group: str = ""


class Covering:
    """The search for the rows of a covering array.

    Attributes:
        uncovered: (values,) * strength: whether values, each a level of a factor, have yet to occur together.
    """

    def __init__(
        self, factors: Sequence[Factor], refused: Sequence[Mapping[str, Collection[str]]], groups: Collection[str] = ()
    ) -> None:
        """Begin.

        Args:
            factors: Factors, each after the factors that it needs.
            refused: Levels that no row has together.
            groups: Names of the groups inside which all triples occur, too.
        """
        self.factors = {factor.name: factor for factor in factors}
        self.refused = {name: [rule for rule in refused if next(iter(rule)) == name] for name in self.factors}
        self.children = {name: [factor for factor in factors if name in factor.needs] for name in self.factors}
        self.values = [(factor.name, level) for factor in factors for level in factor.levels]
        self.number = {value: k for k, value in enumerate(self.values)}
        count = len(self.values)
        self.pairs = np.zeros((count, count), dtype=bool)
        for i, j in combinations(range(count), 2):
            self.pairs[i, j] = self.pairs[j, i] = self._closed({}, [self.values[i], self.values[j]]) is not None
        self.triples = np.zeros((count if groups else 0,) * 3, dtype=bool)
        for group in groups:
            inside = np.array([self.factors[name].group == group for name, _ in self.values])
            pairs = self.pairs & inside[:, None] & inside
            self.triples |= pairs[:, :, None] & pairs[:, None] & pairs[None]

    def each_level(self, names: Collection[str]) -> Iterator[Row]:
        """Yield rows with every permitted level of some factors, and the first levels of the other factors."""
        seen = set[tuple[str, str]]()
        for value in self.values:
            closed = None if value[0] not in names or value in seen else self._closed({}, [value])
            if closed and (row := self._completed(closed, is_plain=True)):
                seen |= {*row.items()}
                yield row

    def rows(self, beginnings: Sequence[Row] = ()) -> Iterator[Row]:
        """Yield rows until every pair and every requested triple has occurred or is proved to be refused.

        Args:
            beginnings: Levels of the first rows, which have the first level of every other factor.
        """
        for begun in beginnings:
            closed = self._closed({}, [*begun.items()])
            row = closed and self._completed(closed, is_plain=True)
            assert row is not None, f"{begun} is refused"
            self._cover([self.number[value] for value in row.items()])
            yield row
        random = np.random.default_rng(0)  # so that the first rows differ in everything
        while True:
            wanted = self.triples if self.triples.any() else self.pairs
            if not wanted.any():
                return
            left = np.flatnonzero(wanted)
            first = np.unravel_index(left[random.integers(len(left))], wanted.shape)
            row = self._closed({}, [self.values[k] for k in first])
            if row is not None:
                row = self._completed(row)
            if row is not None:
                self._cover([self.number[value] for value in row.items()])
                yield row
            for place in {*_permutations(first)}:
                wanted[place] = False

    def _completed(self, row: Row, *, is_plain: bool = False) -> Row | None:
        """Complete a row with a level of every other existing factor; None: its levels are refused together."""
        for name, factor in self.factors.items():
            if name in row or not all(row.get(need) in levels for need, levels in factor.needs.items()):
                continue
            fits = (level for level in factor.levels if self._closed(row, [(name, level)]) is not None)
            options = [*islice(fits, 1 if is_plain else None)]
            if not options:
                return None
            if not is_plain:
                chosen = np.array([self.number[value] for value in row.items()])
                options.sort(key=lambda level: -self._gain(name, level, chosen))
            row = row | {name: options[0]}
        return row

    def _gain(self, name: str, level: str, chosen: np.ndarray) -> float:
        """Count the new combinations that a level adds, including the best level of each factor that it enables."""
        value = self.number[name, level]
        gain = float(self.pairs[value, chosen].sum())
        if self.triples.size:
            gain += float(self.triples[value][np.ix_(chosen, chosen)].sum()) / 2.0
        for other in self.children[name]:
            if level in other.needs[name]:
                numbers = [self.number[other.name, one] for one in other.levels]
                gain += float(self.pairs[np.ix_(numbers, chosen)].sum(axis=1).max())
        return gain

    def _cover(self, numbers: list[int]) -> None:
        self.pairs[np.ix_(numbers, numbers)] = False
        if self.triples.size:
            self.triples[np.ix_(numbers, numbers, numbers)] = False

    def _closed(self, row: Row, added: list[tuple[str, str]]) -> Row | None:
        """Extend a row by levels and their needed levels; None: they contradict each other or the row."""
        row, open_needs = dict(row), dict[str, set[str]]()
        for name, level in added:
            if row.setdefault(name, level) != level:
                return None
        pending = [name for name, _ in added]
        while pending:
            for need, levels in self.factors[pending.pop()].needs.items():
                if need in row:
                    if row[need] not in levels:
                        return None
                    continue
                left = open_needs.setdefault(need, set(self.factors[need].levels))
                left &= set(levels)
                pending.append(need)
        for need, left in open_needs.items():
            options = [level for level in self.factors[need].levels if level in left]
            options = [level for level in options if not self._is_refused(row | {need: level})]
            if not options:
                return None
            row[need] = options[0]
        return None if self._is_refused(row) or self._is_cut_off(row) else row

    def _is_refused(self, row: Row) -> bool:
        rules = (rule for name in row for rule in self.refused[name])  # those that begin with a level of the row
        return any(all(row.get(name) in levels for name, levels in rule.items()) for rule in rules)

    def _is_cut_off(self, row: Row) -> bool:
        """Tell whether a factor of a row needs another level of a second factor in the row."""
        return any(
            need in row and row[need] not in levels for name in row for need, levels in self.factors[name].needs.items()
        )


def _permutations(places: tuple[np.intp, ...]) -> Iterator[tuple[int, ...]]:
    return permutations(tuple(int(place) for place in places))
