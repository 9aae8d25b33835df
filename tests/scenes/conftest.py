"""Fixtures of the scenes' tests."""

from __future__ import annotations

import pytest

from sims.scene import ENGINES


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    """Each engine that is installed and can run here."""
    pytest.importorskip(request.param)
    return request.param
