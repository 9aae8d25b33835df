"""No law may create energy: random impacts, and a closed path that would pump it."""

import numpy as np

from contactlaw import LAWS, MATERIALS, ContactPair, force_along_path, rebound
from validation.case import Array, Case, Data, Limit, Outcome, Table

RESTITUTIONS = [1.0, 0.99, 0.93, 0.86, 0.7, 0.5]  # each needs tables of its own, hence a few, the first most often
CREATORS = ("mindlin",)  # measured and reported, not limited
ASKED = 1e-3
LEG = 32  # points on each leg of the closed path


class Energy(Case):
    """No impact ends with more kinetic energy than it began with, and no closed path yields work, for any law but one:
    the plain `mindlin` spring, which creates energy when the contact unloads.
    """

    place = 30
    title = "No energy from nothing"

    def run(self, quick: bool) -> Outcome:
        count = 2_000 if quick else 10_000
        random = np.random.default_rng(2)
        chi = np.exp(random.uniform(np.log(0.3), np.log(10.0), count))
        psi_1 = random.uniform(-1.0, 1.0, count) * (4.0 * chi + 1.0)
        e = random.choice(RESTITUTIONS, count, p=[0.5, *[0.1] * 5])
        friction = np.exp(random.uniform(np.log(0.01), np.log(10.0), count))
        kappa = random.uniform(0.6, 1.0, count)
        drawn = {"psi_1": psi_1, "chi": chi, "e": e, "mu": friction}
        data: Data = {"gain": {}, "grown": {}, "worst": {}}
        for name in LAWS:
            psi_2 = np.atleast_1d(rebound(psi_1, chi, name, e))
            before, after = (kinetic(psi, v, chi, friction, kappa) for psi, v in ((psi_1, 1.0), (psi_2, e)))
            gain = after / before - 1.0
            most = int(np.argmax(gain))
            data["gain"][name] = float(gain[most])
            data["grown"][name] = float(np.mean(gain > ASKED))
            data["worst"][name] = {key: float(values[most]) for key, values in drawn.items()}
        data["path"] = {name: pump(name) for name in LAWS if name != "coulomb"}
        asked = {f"largest gain of energy, {name}": (name, gain) for name, gain in data["gain"].items()}
        asked |= {f"work extracted on the closed path, {name}": (name, path["extracted"])
                  for name, path in data["path"].items()}  # fmt: skip
        return Outcome([Limit(what, ASKED, part) for what, (name, part) in asked.items() if name not in CREATORS], data)

    def table(self, data: Data) -> Table:
        table = Table("law | largest gain of energy | impacts that gain more than 0.001 | "
                      "psi_1, chi, e, mu of the largest gain | work from the closed path")  # fmt: skip
        for name, gain in data["gain"].items():
            at = "{psi_1:.2f}, {chi:.2f}, {e:.2f}, {mu:.2f}" if gain > 0 else ""
            path = f"{data['path'][name]['extracted']:+.3f}" if name in data["path"] else ""
            table.add(f"{name} | {gain:+.1e} | {100 * data['grown'][name]:.1f} % | {at} | {path}", data["worst"][name])
        return table


def kinetic(psi: Array, normal_speed: Array | float, chi: Array, friction: Array, kappa: Array) -> Array:
    """Kinetic energy at the contact point for m_N = V_z1 = 1: V_x = mu psi/kappa and m_T = kappa/(2 chi)."""
    return 0.5 * normal_speed**2 + 0.5 * (kappa / (2.0 * chi)) * (friction * psi / kappa) ** 2


def pump(law: str) -> Data:
    """Work extracted on a closed path of a contact that never slips as a whole, over the work of its first shift.

    Shift by s at overlap 1, back at overlap 1/2, then the same the other way. Overlap, displacement and, for a
    spring of stiffness k_1 and k_2, force end where they began, and that spring has given (k_1 - k_2) s^2. The
    normal force does the same work up and down.
    """
    steel = MATERIALS["steel"]
    deep = 1e-5
    pair = ContactPair(steel, steel, 0.5, radius=0.01, law=law)
    load = 4.0 / 3.0 * pair.effective_modulus * np.sqrt(0.01) * (deep / 2.0) ** 1.5
    shift = 0.5 * pair.friction * load / (2.0 * pair.effective_shear_modulus * np.sqrt(0.01 * deep))
    corners = [(0, 0), (1, 0), (1, 1), (0.5, 1), (0.5, 0), (1, 0), (1, -1), (0.5, -1), (0.5, 0), (1, 0)]
    at = np.linspace(0.0, len(corners) - 1.0, LEG * (len(corners) - 1) + 1)
    overlap, moved = (np.interp(at, np.arange(len(corners)), one) for one in zip(*corners, strict=True))
    _, force = force_along_path(pair, deep * overlap, shift * moved)
    work = np.append(0.0, np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(shift * moved)))
    return {"extracted": float(-work[-1] / work[2 * LEG])}
