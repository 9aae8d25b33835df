"""Heaps and quadrupeds in PyBullet: cost beside Bullet's own contact, and whether they stand."""

from validation.case import Case, Data, Limit, Outcome, Table
from validation.cases.crowds import cost, median_drop

DROPS = {8: (5, 4.0), 64: (3, 4.0), 216: (1, 0.5)}  # how many, of which the median counts; how long it is watched [s]


class LastingInPyBullet(Case):
    """In PyBullet, too, heaps come to rest and quadrupeds of `pybullet_data` stand still on the motors of their joints:
    at most at three times the processor time of Bullet's own contact, which sinks and slides a little.
    """

    place = 50
    title = "Heaps and quadrupeds in PyBullet"

    def run(self, quick: bool) -> Outcome:
        from validation.pybullet_robots import ROBOTS, watched

        drops: list[Data] = []
        limits: list[Limit] = []
        for count, (seeds, seconds) in list(DROPS.items())[: 1 if quick else None]:
            found = median_drop(range(1 if quick else seeds), count, seconds, solvers=("native",), native="native",
                                engine="pybullet")  # fmt: skip
            drops.append(found)
            limits.append(Limit(f"heap of {count}, drop over native", 3.0, cost(found["drop"], "native")))
        robots = {name: watched(name) for name in ROBOTS}
        limits += [Limit(f"{name} that stands, over native", 3.0, cost(one, "native")) for name, one in robots.items()]
        limits += [Limit(f"{name} that stands, motion", 1e-4, one["moved"], "m") for name, one in robots.items()]
        return Outcome(limits, {"drops": drops, "robots": robots})

    def table(self, data: Data) -> Table:
        table = Table("what | the law, a step | native, a step | the law moved | native moved")
        for name, one in data["robots"].items():
            table.add("{name} | {law_us:.0f} us | {native_us:.0f} us | {moved:.1e} m | {native_moved:.1e} m", one,
                      name=name, law_us=1e6 * one["law"], native_us=1e6 * one["native"])  # fmt: skip
        return table
