"""What is compiled on demand is asked for by compiled code, which can hand no exception on."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ctypes import CFUNCTYPE, c_int64, c_void_p, cast
from typing import NoReturn

import numpy as np
import pytest

from contactlaw import ContactPair
from contactlaw.world import World
from contactlaw.world.data import demand

FLIGHT = 3  # steps before the touch


def spinning_ball() -> World:
    world = World(timestep=1e-3)
    floor = world.add_plane(None, point=(0, 0, 0), normal=(0, 0, 1))
    body = world.add_body(
        mass=0.5, inertia=2e-4, position=(0, 0, 0.02 + (FLIGHT + 0.5) * 1e-3), velocity=(0, 0, -1.0), spin=(0, 0, 50.0)
    )
    world.add_contact(world.add_sphere(body, radius=0.02), floor, ContactPair("steel", "steel", 0.1, 0.9))
    return world


@CFUNCTYPE(None, c_int64)
def _broken(what: int) -> None:
    raise OSError("nobody keeps this")


@contextmanager
def entry(place: int | str, value: int) -> Iterator[None]:
    """Another entry of the table for a while: the address of a function, by its number, or a field."""
    own = demand.TABLE[place] if isinstance(place, str) else demand.TABLE["functions"][0, place : place + 1]
    before, own[0] = int(own[0]), value
    try:
        yield
    finally:
        own[0] = before


def compiler_fault() -> NoReturn:
    raise OSError("no room for machine code")


def interrupt() -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored, where a shell has us in the background
    try:
        signal.raise_signal(signal.SIGINT)
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize(("fault", "kind"), [(compiler_fault, OSError), (interrupt, KeyboardInterrupt)])
@pytest.mark.parametrize("missing", [demand.SPIN, demand.STEP])
def test_what_is_raised_while_something_is_compiled_reaches_who_steps(
    fault: Callable[[], None], kind: type[BaseException], missing: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once, at the step that needs it: that is the last one made."""
    asked: list[int] = []

    def supply(what: int) -> None:
        asked.append(what)
        fault()

    world = spinning_ball()
    world.step()
    with monkeypatch.context() as patched, entry(missing, 0):
        patched.setattr(demand, "supply", supply)
        with pytest.raises(kind):
            world.step(100)
        assert asked == [missing]
        assert not demand.PENDING_ERROR
    made = 1 if missing == demand.STEP else FLIGHT + 1
    assert world.position[0, 2] - 0.02 == pytest.approx(abs(FLIGHT + 0.5 - made) * 1e-3, abs=4e-4)
    world.step(20)
    assert 0.5 < world.velocity[0, 2] < 1.0
    assert np.isfinite(world.spin).all()


def test_what_escapes_even_that_leaves_no_address(monkeypatch: pytest.MonkeyPatch) -> None:
    """An exception outside of `keeps` is only told by Python; whatever comes back is not taken for an address."""
    world = spinning_ball()
    world.step()
    unraisable: list[object] = []
    monkeypatch.setattr("sys.unraisablehook", unraisable.append)
    with entry(demand.SPIN, 0), entry("supply", cast(_broken, c_void_p).value or 0):
        world.step(20)
    assert unraisable
    assert 0.5 < world.velocity[0, 2] < 1.0
