"""Fixtures of the engines' tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture
def client() -> Iterator[int]:
    """A PyBullet client of the test's own."""
    pybullet = pytest.importorskip("pybullet")
    number = pybullet.connect(pybullet.DIRECT)
    yield number
    pybullet.disconnect(number)
