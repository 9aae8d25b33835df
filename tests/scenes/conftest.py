"""Fixtures of the scenes' tests."""

from __future__ import annotations

import numba
import pytest

from sims.scene import ENGINES


@pytest.fixture(params=ENGINES)
def engine(request: pytest.FixtureRequest) -> str:
    """Each engine that is installed and can run here."""
    pytest.importorskip(request.param)
    if request.param == "mujoco" and numba.config.DISABLE_JIT:
        pytest.skip("the MuJoCo plugin needs compiled callbacks")
    return request.param
