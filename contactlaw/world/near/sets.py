"""Two sets of geoms (or links): each geom of one may touch each of the other, but not itself or its own body's geoms.

Two sets of a thousand make half a million pairs, so pairs are not stored. What depends only on the kinds of two geoms
is checked once for each two kinds.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
from typing import Any


class Sets:
    """Two sets of geoms.

    Args:
        ones, twos: Geoms, or their ids, in order.
        body_of: Returns the body of a geom. Geoms of one body may touch only if each set has a single geom.
        allow: Returns whether two geoms may touch, besides; None: all may.
    """

    def __init__(
        self, ones: Iterable[Any], twos: Iterable[Any], body_of: Callable[[Any], Any],
        allow: Callable[[Any, Any], bool] | None = None,
    ) -> None:  # fmt: skip
        self._ranks = [{geom: rank for rank, geom in enumerate(dict.fromkeys(geoms))} for geoms in (ones, twos)]
        self.ones, self.twos = (list(ranks) for ranks in self._ranks)
        self.geoms = list(dict.fromkeys((*self.ones, *self.twos)))
        self._body_of, self._allow, self._single = body_of, allow, len(self.ones) == len(self.twos) == 1

    def hold(self, one: Any, two: Any) -> bool:
        """Return whether two geoms may touch."""
        first, second = self._ranks
        held = (one in first and two in second) or (two in first and one in second)
        return held and self._may_touch(one, two)

    def reversed(self, one: Any, two: Any) -> bool:
        """Return whether the second of two geoms counts as the one of the first set.

        If both orders fit, the geom that is earlier in the first set counts as the one of the first set.
        """
        first, second = self._ranks
        if not (two in first and one in second):
            return False
        return not (one in first and two in second) or first[two] < first[one]

    def example(self, ones: Iterable[Any], twos: Iterable[Any]) -> tuple[Any, Any] | None:
        """Return two geoms that may touch, of subsets of the first and of the second set; None: there are none."""
        found = (pair for pair in _rows(list(ones), list(twos)) if self._may_touch(*pair))
        return next(found, None)

    def common(self, other: Sets) -> tuple[Any, Any] | None:
        """Return two geoms that may touch by these sets and by other ones; None: there are none."""
        first, second = other._ranks
        straight = self.example(filter(first.__contains__, self.ones), filter(second.__contains__, self.twos))
        return straight or self.example(filter(second.__contains__, self.ones), filter(first.__contains__, self.twos))

    def by_kinds(self, kind_of: Callable[[Any], Hashable]) -> Iterator[tuple[Any, Any]]:
        """Yield two geoms that may touch for each two kinds that have such geoms."""
        ones, twos = (groups(geoms, kind_of).values() for geoms in (self.ones, self.twos))
        yield from filter(None, (self.example(one, two) for one in ones for two in twos))

    def every(self, among: Callable[[Any], bool] = lambda _: True) -> Iterator[tuple[Any, Any]]:
        """Yield, once each, pairs with a geom for which `among` is true; by default all pairs, one by one."""
        meant = [two for two in self.twos if among(two)]
        for one in self.ones:
            for two in self.twos if among(one) else meant:
                if self._may_touch(one, two) and not self.reversed(one, two):  # else it comes, or has come, so
                    yield one, two

    def _may_touch(self, one: Any, two: Any) -> bool:
        apart = one != two and (self._single or self._body_of(one) != self._body_of(two))
        return apart and (self._allow is None or self._allow(one, two))


def groups(geoms: Iterable[Any], kind_of: Callable[[Any], Hashable]) -> dict[Any, list[Any]]:
    """Return lists of geoms by kind."""
    out: dict[Any, list[Any]] = {}
    for geom in geoms:
        out.setdefault(kind_of(geom), []).append(geom)
    return out


def systems_of(sets: Iterable[set[int]]) -> dict[int, list[int]]:
    """Return the numbers that sets with common ones make one system, in order, by each of them."""
    out: dict[int, set[int]] = {}
    for own in sets:
        whole = own.union(*(out.get(one, ()) for one in own))
        out |= dict.fromkeys(whole, whole)
    return {one: sorted(system) for one, system in out.items()}


def _rows(ones: list[Any], twos: list[Any]) -> Iterator[tuple[Any, Any]]:
    """Yield the pairs of the first three geoms of each list with all of the other.

    If any two may touch, two of these may: they include geoms of different bodies, and links of a tree that are not
    neighbours, if there are any.
    """
    yield from ((one, two) for one in ones[:3] for two in twos)
    yield from ((one, two) for one in ones for two in twos[:3])
