"""What only some scenes come to need: called by address, and compiled when a scene first needs it.

A step asks Python for the address, once in a process (`call.address`); there is nothing else that it calls Python for.
"""

from __future__ import annotations

from ctypes import CFUNCTYPE, c_int64, c_uint64, c_void_p, cast
from functools import lru_cache

import numpy as np

from contactlaw.jit import compiling

STEP, LAST, LIMIT, TWIST, ALONG, READ = range(6)
"""`step.step_once`, `lasting.let_last`, `spinning.limit`, `spinning.twist`, `elliptic.advance`, `state.read`."""

FOUND = np.zeros(6, np.uint64)
"""Addresses of those that have been asked for."""


@lru_cache
def supply(what: int) -> int:
    """The address of one of them."""
    from contactlaw.world import elliptic, lasting, spinning, state, step  # which need the records that need this

    if what == STEP:
        FOUND[what] = step.address_of_step()
    elif what == READ:
        with compiling("states that are set back", 2):
            FOUND[what] = state.address_of_read()
    elif what == LAST:
        with compiling("contacts that last", 8):
            FOUND[what] = lasting.address()
    elif what == ALONG:
        with compiling("elliptic contacts", 2):
            FOUND[what] = elliptic.address()
    else:
        with compiling("contacts that spin", 4):
            FOUND[what] = (spinning.address_of_limit if what == LIMIT else spinning.address_of_twist)()
    return int(FOUND[what])


@CFUNCTYPE(c_uint64, c_int64)
def _supply(what: int) -> int:
    return supply(what)


DEMAND = int(cast(_supply, c_void_p).value or 0)
"""Address of what is asked for them."""
