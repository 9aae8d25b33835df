"""The front of error against run time: what beats what, and what noise of the clock may not do."""

from __future__ import annotations

import numpy as np
import pytest

from validation import front
from validation.front import Rung, beaten_by, closest, non_dominated, time_for, weighed

ROUNDS = 8


def steady(time: float) -> np.ndarray:
    return np.full(ROUNDS, time)


def brute_force(errors: dict[str, float], times: dict[str, float]) -> set[str]:
    """Nothing is at least as good in error and better in time."""
    return {
        a for a in errors if not any(errors[b] <= errors[a] and times[b] < times[a] for b in errors if b != a)
    }  # fmt: skip


@pytest.mark.parametrize("seed", range(5))
def test_the_front_is_that_of_the_definition(seed):
    random = np.random.default_rng(seed)
    names = [f"way {n}" for n in range(30)]
    errors = dict(zip(names, random.uniform(0.0, 1.0, 30).tolist(), strict=True))
    times = dict(zip(names, random.uniform(1.0, 9.0, 30).tolist(), strict=True))
    found = non_dominated(errors, {name: steady(time) for name, time in times.items()})
    assert set(found) == brute_force(errors, times) and 0 < len(found) < 30
    assert [times[name] for name in found] == sorted(times[name] for name in found)
    assert [errors[name] for name in found] == sorted((errors[name] for name in found), reverse=True)


def test_a_worse_and_slower_way_is_beaten():
    errors = {"good": 0.1, "bad": 0.2, "fast": 0.9}
    seconds = {"good": steady(1.0), "bad": steady(2.0), "fast": steady(0.1)}
    assert non_dominated(errors, seconds) == ["fast", "good"]
    assert beaten_by("bad", errors, seconds) == ["good"]
    assert beaten_by("fast", errors, seconds) == []


def test_what_drifts_together_is_compared_round_by_round():
    drift = np.linspace(1.0, 5.0, ROUNDS)  # a machine that slows down: medians and quartiles overlap widely
    assert non_dominated({"a": 0.1, "b": 0.1}, {"a": 1.00 * drift, "b": 1.02 * drift}) == ["a"]


def test_times_that_the_clock_cannot_tell_apart_beat_nothing():
    a = np.array([1.0, 1.1, 1.0, 1.1, 1.0, 1.1, 1.0, 1.1])
    b = np.array([1.1, 1.0, 1.1, 1.0, 1.1, 1.0, 1.1, 1.0])
    assert set(non_dominated({"a": 0.1, "b": 0.2}, {"a": a, "b": b})) == {"a", "b"}


def test_what_is_not_finite_is_on_no_front():
    assert non_dominated({"a": np.nan, "b": 0.2}, {"a": steady(1.0), "b": steady(2.0)}) == ["b"]


def test_names_must_agree():
    with pytest.raises(ValueError, match="differ in \\['b'\\]"):
        non_dominated({"a": 1.0}, {"a": steady(1.0), "b": steady(1.0)})


def test_closest_within_a_time():
    errors, times = {"a": 0.5, "b": 0.1}, {"a": 1.0, "b": 2.0}
    assert closest(errors, times, 1.5) == 0.5
    assert closest(errors, times, 2.0) == 0.1
    assert closest(errors, times, 0.5) == float("inf")


def test_time_for_an_error_follows_powers():
    sizes = np.array([5.0, 10.0, 20.0, 40.0])
    errors = {str(n): float(n**-2) for n in sizes}  # second order in n
    times = {str(n): float(n**3) for n in sizes}
    assert time_for(errors, times, 15.0**-2) == pytest.approx(15.0**3, rel=1e-12)
    assert time_for(errors, times, 1.0) == pytest.approx(5.0**3)  # closer than asked already
    assert time_for(errors, times, 50.0**-2) == float("inf")


def example() -> dict[str, Rung]:
    error = np.array([0.003, -0.004])
    return {
        "law, default": Rung("law", error, steady(2e-6), steps=steady(4.0)),
        "law, fine": Rung("law", 0.1 * error, steady(9e-6)),
        "spring, fast": Rung("spring", 100.0 * error, steady(2.1e-6)),
        "spring, slow": Rung("spring", 99.0 * error, steady(3e-6)),
        "wild": Rung("wild", np.array([0.0, 0.0]), steady(1e-9), problem="energy grown to 2"),
        "rings": Rung("rings", 0.5 * error, steady(8e-4)),
    }


def test_weighed_tells_all():
    data = weighed(example())
    assert data["front"] == ["law, default", "law, fine"]
    assert data["dominated"] == ["spring", "rings"]
    own = data["rungs"]["law, default"]
    assert own["largest"] == 0.004 and own["rms"] == pytest.approx(np.sqrt(12.5e-6)) and own["beaten"] == 0
    assert own["microseconds"]["median"] == pytest.approx(2.0)
    assert own["step_microseconds"]["median"] == pytest.approx(0.5)
    assert data["rungs"]["rings"]["beaten_by"] == ["law, fine"]
    assert "largest" not in data["rungs"]["wild"]


def test_comparisons_with_other_families():
    data = weighed(example())
    assert front.closer(data, "law, default", ["spring"]) == pytest.approx(100.0)  # none as fast: the fastest
    assert front.closer(data, "law, fine", ["spring"]) == pytest.approx(990.0)  # both faster: the closest
    assert front.faster(data, "law, default", ["rings"]) == pytest.approx(400.0)
    assert front.faster(data, "law, fine", ["rings"]) == pytest.approx(8e-4 / 9e-6)  # never as close: the closest


def test_rows_say_where_each_stands():
    standing = {row[0]: row[-1] for row in front.rows(weighed(example()), "law, default")}
    assert standing == {
        "law, default": "yes",
        "law, fine": "yes",
        "spring, slow": "no setting of spring is, beaten by law, default",
        "rings": "no setting of rings is, beaten by law, fine",
        "wild": "does not count: energy grown to 2",
    }
