"""What all tests share: their order, what needs the compiler, and that hypothesis runs the same examples every time."""

from __future__ import annotations

import sys

import numba
import pytest
from hypothesis import settings

settings.register_profile("contactlaw", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("contactlaw")


WORLDS = ("engines", "golden", "scenes", "world")  # folders whose tests run the kernels of worlds


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Order tests so that workers compile different kernels; skip what takes too long without compilation.

    xdist gives each worker a share of the tests in order, then what is next. The first begins with worlds and compiles
    their kernels; meanwhile the others have tests that run none, and find them in the cache later.
    """
    if xdist := getattr(config, "workerinput", None):
        share = len(items) // xdist["workercount"] // 4
        worlds, others = ([item for item in items if (item.path.parent.name in WORLDS) is of] for of in (True, False))
        items[:] = worlds[:share] + others + worlds[share:]
    if not numba.config.DISABLE_JIT:
        return
    skip = pytest.mark.skip(reason="needs the JIT")
    for item in items:
        if item.get_closest_marker("heavy") or item.path.parent.name in ("engines", "world"):
            item.add_marker(skip)


@pytest.fixture
def no_other_client() -> None:
    """PyBullet's calls mean client 0 unless told otherwise: close what other tests have left open."""
    engine = sys.modules.get("pybullet")
    for client in range(64):
        if engine is not None and engine.isConnected(client):
            engine.disconnect(client)
