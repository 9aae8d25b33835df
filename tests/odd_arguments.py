"""Values that a caller may give by mistake, and what must become of them: a result, or an error that names them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from math import inf, nan
from typing import Any

import numpy as np

ODD = [
    np.array([1.0, 2.0]), [1, 2.0], (1, 2.0, 3.0), np.array([]), [], [[1, 2]], [1, [2, 3]], np.array([[1.0, 2.0, 3.0]]),
    np.array(1.0), np.float32(1), np.bool_(True), np.array(["a"]), np.ma.masked, "x", "", b"x", ["a"], [None], [True],
    None, nan, inf, -inf, True, False, 0, 2, -1.0, 1e-320, 1e308, 10**400, 1j, {}, {1, 2}, object(),
]  # fmt: skip


def check_odd_arguments(function: Callable[..., Any], named: dict[str, Any], words: dict[str, str] | None = None):
    """Give each argument each odd value in turn: what is raised must be a ValueError that names the argument.

    Args:
        function: To be called with keywords.
        named: Values of all arguments that are right.
        words: Of an argument: by what else its errors may name it.
    """
    wrong = []
    for name in named:
        for value in ODD:
            try:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    result = function(**{**named, name: value})
            except ValueError as error:
                if name not in str(error) and (words or {}).get(name, name) not in str(error):
                    wrong.append(f"{name} = {value!r}: {error}")
            except Exception as error:
                wrong.append(f"{name} = {value!r}: {type(error).__name__}: {error}")
            else:
                if isinstance(result, float | np.ndarray) and not np.isfinite(result).all():
                    wrong.append(f"{name} = {value!r}: result {result}")
    assert not wrong, "\n".join(line[:200] for line in wrong)
