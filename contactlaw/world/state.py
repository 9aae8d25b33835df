"""stub"""
from contactlaw.jit import jit_inside


def size(world):
    return 1

@jit_inside
def pack(w, out):
    out[0] = 0.0
    return 1

@jit_inside
def unpack(w, numbers):
    w.stale = 1
    return 0
