"""What all tests share: heavy tests and worlds need the compiler, and hypothesis runs the same examples every time."""

from __future__ import annotations

import sys

import numba
import pytest
from hypothesis import settings

settings.register_profile("contactlaw", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("contactlaw")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip heavy tests, and those of worlds, where the kernels run as plain Python."""
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
