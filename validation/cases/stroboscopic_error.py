"""Effect of a drafting error on the points of Figs. 3 and 5 of Maw, Barber & Fawcett (1981)."""

from typing import NamedTuple

import numpy as np

from contactlaw import rebound
from sims.puck import Puck
from validation.case import Array, Case, Data, Limit, Outcome, Table
from validation.stroboscope import Reading, fit_motion, pictured, read_impact

DRAFTING = [0.1, 0.25, 0.5]  # standard deviation of a coordinate on the print [mm]
PRINT_SCALE = 0.4  # print over table: a field of half a metre on a print of 8 by 10 in
FIELD = 0.25  # path of the centre seen before and after the impact [m]
FLASHES = 100.0  # a second
MOST_FLASHES = 16  # of a flight that can be told apart on a print
THROW = 1.0  # speed of the centre before the impact [m/s]
BACKSPIN = {"steel": 0.0, "rubber": 0.5}  # share of the contact point's tangential velocity that is spin
INCIDENCES = {"steel": [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "rubber": [0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]}
MARKERS = (0.9, np.array([0.4, 0.4 + np.pi]))  # the ends of a strip of tape: radius over the puck's, angles [rad]
SEED = 1981


class StroboscopicError(Case):
    """A drafting error of a quarter of a millimetre in stroboscopic pictures leaves psi of steel accurate to some
    hundredths at every incidence. For rubber the error grows steeply with the incidence, as the paper says.
    Independently of this, eq. (6) gives mu low by (1 - e)/2, since it takes e = 1.
    """

    place = 8
    title = "The paper's procedure: effect of the drafting error"

    def run(self, quick: bool) -> Outcome:
        draws = 60 if quick else 400
        random = np.random.default_rng(SEED)
        materials: dict[str, list[Data]] = {material: [] for material in INCIDENCES}
        ratios, exact = [], 0.0
        scenes = [_scene(material, psi_1) for material, incidences in INCIDENCES.items() for psi_1 in incidences]
        for scene in scenes:
            exact = max(exact, float(np.abs(_read(scene, None).psi(scene.kappa, scene.friction)[0] - scene.psi).max()))
            row: Data = {"psi_1": scene.psi[0], "psi_2": scene.psi[1]}
            for drafting in DRAFTING:
                error = 1e-3 * drafting / PRINT_SCALE
                readings = [_read(scene, error, random) for _ in range(draws)]
                found = np.array([one.psi(scene.kappa, scene.friction)[0] for one in readings])
                friction = np.array([one.friction for one in readings]) / scene.friction
                row[f"{drafting:g}"] = {"scatter": found.std(axis=0), "friction": float(friction.std()),
                                        "friction_bias": float(friction.mean() - 1.0)}  # fmt: skip
                if drafting == DRAFTING[0]:
                    ratios.append(found.std(axis=0) / _read(scene, error).psi(scene.kappa, scene.friction)[1])
            materials[scene.material].append(row)
        ratio = float(np.sqrt(np.mean(np.square(ratios))))
        limits = [
            Limit("psi read from exact points, off by", 1e-9, exact),
            Limit(f"scatter at {DRAFTING[0]:g} mm over that of the covariance, off 1 by", 0.05, abs(ratio - 1.0)),
        ]
        return Outcome(limits, {"materials": materials, "drafting": DRAFTING})

    def table(self, data: Data) -> Table:
        middle = f"{data['drafting'][1]:g}"
        table = Table(f"puck | psi_1 | psi_2 | error of psi_1, {middle} mm | error of psi_2 | error of mu by eq. (6)")
        for material, rows in data["materials"].items():
            edge = 4.0 * Puck(material=material).chi - 1.0
            for row in rows:
                sliding = "{friction_bias:+.1%} +- {friction:.1%}" if row["psi_1"] >= edge else "-"
                table.add(material + " | {psi_1:g} | {psi_2:.3f} | {scatter[0]:.4f} | {scatter[1]:.4f} | " + sliding,
                          row, row[middle])  # fmt: skip
        return table


class _Scene(NamedTuple):
    """An impact as it is, in the frame of a block whose normal is x: flights (velocity, spin), flash times [s]."""

    material: str
    flights: list[tuple[Array, float]]
    times: list[Array]
    psi: Array
    kappa: float
    friction: float
    radius: float


def _scene(material: str, psi_1: float) -> _Scene:
    """The exact motion before and after, and when the flashes fall.

    The tangential impulse changes the velocity of a disk's centre by a third of that of the contact point.
    """
    puck = Puck(material=material, psi_1=psi_1)
    mu, kappa, e, radius = puck.pair.friction, puck.pair.kappa, puck.pair.restitution, puck.radius
    psi_2 = float(rebound(psi_1, puck.chi, restitution=e))
    first, second = psi_1 * mu / kappa, psi_2 * mu / kappa  # tangential over approach velocity of the contact point
    share = BACKSPIN[material]
    approach = THROW / np.hypot(1.0, (1.0 - share) * first)
    aimed, spin = (1.0 - share) * first, -share * first / radius
    change = second - first
    flights = [
        (approach * np.array([-1.0, aimed]), approach * spin),
        (approach * np.array([e, aimed + change / 3.0]), approach * (spin - 2.0 / 3.0 * change / radius)),
    ]
    seen = [int(FIELD / float(np.linalg.norm(velocity)) * FLASHES) for velocity, _ in flights]
    counts = [min(max(count, 3), MOST_FLASHES) for count in seen]
    times: list[Array] = [(np.arange(count, dtype=np.float64) + 0.5) / FLASHES for count in counts]
    times[0] = -times[0][::-1]
    return _Scene(material, flights, times, np.array([psi_1, psi_2]), kappa, mu, radius)


def _read(scene: _Scene, error: float | None, random: np.random.Generator | None = None) -> Reading:
    """One picture read: with the scatter of a drafting error [m on the table], or exact points without `random`."""
    share, angles = MARKERS
    radii = np.full(angles.size, share * scene.radius)
    motions = []
    for (velocity, spin), times in zip(scene.flights, scene.times, strict=True):
        centres, markers = pictured(times, (scene.radius, 0.0), velocity, angles, spin, radii)
        if random is not None and error is not None:
            centres, markers = (x + error * random.standard_normal(x.shape) for x in (centres, markers))
        motions.append(fit_motion(times, centres, markers, radii, 1e-6 if error is None else error))
    return read_impact(*motions, normal=(1.0, 0.0), radius=scene.radius, inertia_factor=3.0)
