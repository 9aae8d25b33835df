"""What all tests share: their order, what needs the compiler, and that hypothesis runs the same examples every time."""

from __future__ import annotations

import sys

import numba
import pytest
from hypothesis import settings

settings.register_profile("contactlaw", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("contactlaw")


WORLDS = ("engines", "golden", "scenes", "world")  # folders whose tests run the kernels of worlds
# worlds are for compiled code alone
collect_ignore_glob = [f"{folder}/*.py" for folder in ("engines", "scenes", "world") if numba.config.DISABLE_JIT]


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Order tests so that workers compile different kernels; skip what takes too long without compilation.

    xdist gives each worker a share of the tests in order, then what is next. The first begins with worlds and compiles
    their kernels; meanwhile the others have tests that run none, and find them in the cache later.
    """
    if xdist := getattr(config, "workerinput", None):
        share = len(items) // xdist["workercount"] // 4
        worlds, others = ([item for item in items if (item.path.parent.name in WORLDS) is of] for of in (True, False))
        items[:] = worlds[:share] + others + worlds[share:]
    for item in items:
        if numba.config.DISABLE_JIT and item.get_closest_marker("heavy"):
            item.add_marker(pytest.mark.skip(reason="needs the JIT"))


@pytest.fixture
def no_other_client() -> None:
    """PyBullet's calls mean client 0 unless told otherwise: close what other tests have left open."""
    engine = sys.modules.get("pybullet")
    for client in range(64):
        if engine is not None and engine.isConnected(client):
            engine.disconnect(client)
