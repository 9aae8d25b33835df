"""The solvers that judge slides that turn, and spin, against what is known exactly and against each other."""

from typing import Any

import numpy as np

from validation.case import Case, Data, Limit, Outcome, Progress, Table, register

DISK = 1.256  # chi
BALL = 1.465
INCIDENCES = [0.25, 0.5, 1.0, 1.2, 2.0, 3.0, 4.0, 5.0]
SPINS = [0.05, 0.1, 0.18, 0.3]
EARLIER = [-0.010, -0.037, -0.10]  # change of psi_2 of the first three, of another program, two digits
STICK_RADII = [0.95, 0.8, 0.6, 0.4, 0.2, 0.1]
P = 4.0 / 3.0  # normal force at overlap 1


@register
class TurningReference(Case):
    """Two solvers with local Coulomb friction judge what the annuli cannot: rings with a traction vector each, and
    square cells with the full kernel of Cerruti, any nu and spin about the normal. On a straight slide both give the
    annuli's rebound, in torsion the grid gives Lubkin's moment, and on a circle they agree.
    """

    place = 23
    title = "Slides that turn, and spin: the reference"
    needs = ("scipy",)

    def run(self, quick: bool, progress: Progress) -> Outcome:
        from validation.reference.turning_data import load

        rings_error = _straight_rings(INCIDENCES[1::3] if quick else INCIDENCES, 16 if quick else 32)
        progress(0.3)
        torsion = _torsion(64 if quick else 128)
        progress(0.5)
        circle = _circle(32 if quick else 64)
        progress(0.7)
        spin = _spin(SPINS[:2] if quick else SPINS, 8 if quick else 16)
        data: Data = {"rings": rings_error, "torsion": torsion, "circle": circle, "spin": spin}
        saved = load()
        limits = [
            Limit("rings, straight: psi_2 from the annuli", 2e-3 if quick else 3e-4, max(rings_error)),
            Limit("grid, straight: psi_2 from the annuli", 5e-3 if quick else 1e-3, spin["still"]),
            Limit("grid, torsion: M/M_s from Lubkin's", 1e-3 if quick else 3e-4, max(torsion)),
            Limit("rings and grid on a circle, F/(mu P)", 2e-3 if quick else 1e-3, circle),
            Limit("spin: change of psi_2 from an earlier grid's", 1e-2, spin["from_earlier"]),
            Limit("saved forces: estimated error, F/(mu P)", 2e-3, max(one["error"] for one in saved["forces"])),
            Limit("saved psi_2, masses 3:1: estimated error", 2e-3, max(one[-1] for one in saved["uneven"])),
            Limit("saved psi_2 with spin: estimated error", 3e-3, max(one[-1] for one in saved["spinning"])),
            Limit("saved figures computed anew, coarser", 5e-3, _anew(saved)),
        ]  # fmt: skip
        finite = all(np.isfinite(limit.reached) for limit in limits)
        return Outcome(limits, data, [] if finite else ["a value is not finite"])

    def table(self, data: Data) -> Table:
        spin = data["spin"]
        table = Table([f"sigma (chi = {BALL}, psi_1 = 0.5)", "change of psi_2", "-4 sigma^2"])
        for sigma, change in zip(spin["sigma"], spin["change"], strict=True):
            table.rows.append([f"{sigma}", f"{change:.4f}", f"{-4.0 * sigma**2:.4f}"])
        return table


def _straight_rings(incidences: list[float], least: int) -> list[float]:
    from validation.reference import annulus, rings
    from validation.reference.refinement import extrapolated

    def error(psi: float) -> float:
        found, _ = extrapolated(lambda m: rings.rebound([psi, 0.0], DISK, rings=m, steps=16 * m), least)
        return float(abs(found[0] - annulus.rebound_extrapolated(psi, DISK)[0]))

    return [error(psi) for psi in incidences]


def _torsion(cells: int) -> list[float]:
    from validation.reference import grid
    from validation.reference.closed_forms import torsion

    nu = 0.3
    path = np.zeros((len(STICK_RADII) + 1, 3))
    path[1:, 2] = torsion.angle(STICK_RADII) * P / (0.25 * (2.0 - nu))
    moment = grid.force_along_path(np.ones(len(path)), path, nu=nu, cells=cells)[1:, 2]
    return (np.abs(moment / P - torsion.moment(STICK_RADII)) / torsion.FULL_SLIP).tolist()


def _circle(cells: int) -> float:
    """Largest difference along a turn and a half of partial slip, both with the same steps."""
    from validation.reference import grid, rings
    from validation.reference.turning_paths import path

    approach, slide = path("circle", 0.6, 2)
    moved = np.column_stack([slide, np.zeros(len(slide))])
    force = grid.force_along_path(approach, moved, cells=cells)[:, :2]
    return float(np.abs(force - rings.force_along_path(approach, slide, rings=128)).max()) / P


def _spin(sigmas: list[float], least: int) -> dict[str, Any]:
    from validation.reference import annulus, grid
    from validation.reference.refinement import extrapolated

    def psi_2(sigma: float) -> float:
        chi = [BALL, BALL, 0.0]
        return float(extrapolated(lambda m: grid.rebound([0.5, 0.0, sigma], chi, cells=m, steps=8 * m), least)[0][0])

    still = psi_2(0.0)
    change = [psi_2(sigma) - still for sigma in sigmas]
    from_earlier = max(abs(one - other) for one, other in zip(change, EARLIER, strict=False))
    from_annuli = abs(still - annulus.rebound_extrapolated(0.5, BALL)[0])
    return {"sigma": sigmas, "change": change, "from_earlier": from_earlier, "still": from_annuli}


def _anew(saved: Data) -> float:
    """Largest difference of some saved figures from a coarser computation, extrapolated too."""
    from validation.reference import turning_data
    from validation.reference.turning_paths import NAMES

    differences = []
    for name in NAMES:
        amplitude = turning_data.AMPLITUDES[2]
        (one,) = [one for one in saved["forces"] if one["path"] == name and one["amplitude"] == amplitude]
        force, _ = turning_data.force(name, amplitude, 16)
        differences.append(np.abs(force - np.array(one["force"])).max())
    for chi_1, chi_2, psi, heading, *known, _ in saved["uneven"][7::15]:
        found, _ = turning_data.uneven_rebound([chi_1, chi_2], psi, heading, 16)
        differences.append(np.abs(found - known).max())
    for nu, chi_s, psi, sigma, *known, _ in saved["spinning"][12::25]:
        found, _ = turning_data.spinning_rebound(nu, chi_s, psi, sigma, 12)
        differences.append(np.abs(found - known).max())
    return float(max(differences))
