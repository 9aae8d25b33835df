"""Heaps and quadrupeds in PyBullet: cost beside Bullet's own contact, and whether they stand."""

from collections.abc import Callable
from functools import partial

import numpy as np

from contactlaw import ContactPair, Material
from validation import lasting_scenes as lasting
from validation.case import Case, Data, Limit, Outcome
from validation.cases.crowds import cost, median_drop

DROPS = {8: (5, 4.0), 64: (3, 4.0), 216: (1, 6.0)}  # how many, of which the median counts; how long it is watched [s]
SETTLED = 20  # runs of `lasting.STEPS` until a robot stands
RUBBER = ContactPair(Material(1e8, 0.4), Material(1e8, 0.4), friction=0.8, restitution=0.5)
"""Of a hard kind."""


class LastingInPyBullet(Case):
    """In PyBullet, too, heaps come to rest and quadrupeds of `pybullet_data` stand still on the motors of their joints:
    at most at three times the processor time of Bullet's own contact.
    """

    place = 50
    title = "Heaps and quadrupeds in PyBullet"

    def run(self, quick: bool) -> Outcome:
        from sims.quadrupeds import ROBOTS

        drops: list[Data] = []
        limits: list[Limit] = []
        for count, (seeds, seconds) in list(DROPS.items())[: 1 if quick else None]:
            found = median_drop(range(1 if quick else seeds), count, seconds, native="native", engine="pybullet")
            drops.append(found)
            limits.append(Limit(f"heap of {count}, drop over native", 3.0, cost(found["drop"], "native")))
        robots = {name: watched(name) for name in ROBOTS}
        limits += [Limit(f"{name} that stands, over native", 3.0, cost(one, "native")) for name, one in robots.items()]
        limits += [Limit(f"{name} that stands, motion", 1e-4, one["moved"], "m") for name, one in robots.items()]
        return Outcome(limits, {"drops": drops, "robots": robots})


def watched(name: str) -> dict[str, float]:
    """Median processor times of a step [s] of a robot that stands, "law" and "native", and how far its base moves by
    the law in these steps [m], "moved".
    """
    import pybullet as p

    from sims.quadrupeds import standing

    law, native = p.connect(p.DIRECT), p.connect(p.DIRECT)
    robot, contact, _ = standing(law, name, RUBBER)
    standing(native, name, None)
    runs = {"law": partial(_steps, contact.step), "native": partial(_steps, partial(p.stepSimulation, native))}
    for run in runs.values():
        for _ in range(SETTLED):
            run()
    place = p.getBasePositionAndOrientation(robot, law)[0]
    found = lasting.a_step(runs)
    moved = np.subtract(p.getBasePositionAndOrientation(robot, law)[0], place)
    for client in (law, native):
        p.disconnect(client)
    return found | {"moved": float(np.linalg.norm(moved))}


def _steps(step: Callable[[], object]) -> None:
    for _ in range(lasting.STEPS):
        step()
