"""Heaps, a tube and slopes: creep, energy, and cost beside MuJoCo's own contact."""

from collections.abc import Iterable
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np

from validation.case import Case, Data, Limit, Outcome, Table

CREEP = {"law": {}, "native, default": {}, "native, best": {"best": 1.0}}
LONG = 60.0  # [s]
WIDE = 2.5 * 0.01, 1.5  # [m] between balls that are poured into a box with room on its floor; [s]
CROWD, FIRST = 1000, 0.2  # balls, and how long they fall [s], which is their dearest time
DROPS = {8: (3.0, 4.0), 64: (2.0, 4.0), 216: (2.0, 6.0), CROWD: (1.5, 6.0)}  # asked, and how long it is watched [s]
SEEDS = {8: 5, 64: 5, 216: 3}  # how many drops of steel, of which the one of the median cost counts
MANY, FALL = 3000, 0.04  # balls, and how long they fall [s]
OTHERS = {
    "heap of 64 of rubber": (1.0, 0.5, {"material": "rubber", "friction": 0.8, "restitution": 0.8}),
    "heap of 64 of glass, R 1 mm": (5.0, 0.3, {"material": "glass", "radius": 1e-3, "restitution": 0.9}),
}  # asked, how long they are watched [s], and what they are made of
HELD = (0.1, 0.3, 1.0)  # [kg]


class Crowds(Case):
    """A box on a slope lies still. Heaps come to rest and sleep, floor and walls carry their weight, and no step gains
    energy. In processor time over MuJoCo's own contact, a drop until rest should cost at most two or three times as
    much, a sleeping heap less than a third, and thousands of falling balls at most half as much again. A heap rests
    when 98 in a hundred balls sleep: what rolls on the floor beside it, nothing brakes.
    """

    place = 49
    title = "Heaps and persistent contacts"

    def run(self, quick: bool) -> Outcome:
        from sims import heap
        from sims.scene import NATIVE, NONE, Settings, find_scenes
        from validation import lasting_scenes as lasting

        slope, pile = (find_scenes()[name] for name in ("slope", "heap"))
        creep: dict[str, float] = {}
        for name, options in CREEP.items():
            settings = Settings("mujoco", None if name == "law" else NATIVE, options={"seconds": LONG} | options)
            creep[name] = slope.measure(slope.run(settings))["creep_um_per_s"]
        limits = [Limit("creep of a box on a slope", 1e-4, abs(creep["law"]), "um/s")]
        counts = (8,) if quick else (8, 64)
        kept = [pile.measure(pile.run(Settings(NONE, options={"balls": count}))) for count in counts]
        limits += [
            Limit("energy a heap gains in a step, over the first", 1e-6, max(one["energy_rise"] for one in kept)),
            Limit("support of a heap over its weight, less 1", 1e-9,
                  max(abs(one["support_over_weight_less_1"]) for one in kept)),
            Limit("a heap sleeps after", 10.0, max(one["settled"] or np.inf for one in kept), "s"),
        ]  # fmt: skip

        heaps = [(f"heap of {count}", asked, count, seconds, {}) for count, (asked, seconds) in DROPS.items()]
        heaps += [("heap of 64 in a wide box", 2.0, 64, WIDE[1], {"pitch": WIDE[0]})]
        heaps += [(name, asked, 64, seconds, {"o": SimpleNamespace(**(vars(heap.DEFAULT) | made))})
                  for name, (asked, seconds, made) in OTHERS.items()]  # fmt: skip
        drops: list[Data] = []
        for name, asked, count, seconds, how in heaps[: 1 if quick else None]:
            seeds = 1 if "o" in how else SEEDS.get(count, 1)
            found = median_drop(range(seeds), count, seconds, **how)
            name = name if seeds == 1 else f"{name}, median of {seeds}"
            what = name if found["settled"] else f"{name}, its first {seconds:g} s"
            drops.append(found | {"what": what})
            limits += drop_limits(what, found, asked, "CG")
        if not quick:
            made_in = heap.build_times(CROWD)
            limits += [Limit(f"{CROWD} balls added and compiled", 2.0, made_in["model"], "s"),
                       Limit(f"{CROWD} balls, an MjData", 0.1, made_in["data"], "s")]  # fmt: skip
        grasps: list[Data] = []
        for material, mass in product(("steel", "rubber"), HELD[: 1 if quick else None]):
            runs = sorted((lasting.grasp(material, mass, 3.0) for _ in range(5)), key=lambda r: r["law"] / r["native"])
            held = lasting.grasp(material, mass, 4.0 if quick else LONG) | {k: runs[2][k] for k in ("law", "native")}
            what = f"grasp of {mass:g} kg by {material}"
            grasps.append(held | {"what": what})
            limits += [Limit(f"{what}, slip in a minute", 5e-3, 1e6 * abs(held["slip"]), "um"),
                       Limit(f"{what}, over native", 2.0, held["law"] / held["native"])]  # fmt: skip
        found = heap.timed({"law": lasting.tube(True), "native": lasting.tube(False)}, 3.0)
        drops.append(found | {"what": "tube of 5"})
        limits += drop_limits("tube of 5", found, 2.0, "native")

        steps = {"a box on ball feet on a slope": lasting.lying_box()}
        if (path := lasting.ant()) is not None:
            steps["an ant that stands"] = lasting.standing_ant(path)
        if not quick:
            worlds = {kind: lasting.crowd(MANY, kind) for kind in ("law", *heap.SOLVERS)}
            fall = heap.timed(worlds, FALL)["drop"]
            steps[f"{MANY} balls that fall"] = fall | {"native": min(fall[one] for one in heap.SOLVERS)}
        limits += [Limit(f"{name}, over native", 1.2 if "slope" in name else 1.5, one["law"] / one["native"])
                   for name, one in steps.items()]  # fmt: skip
        falling = {} if quick else {"falling": cost(heap.costs(CROWD, FIRST, solvers=("CG",))["drop"], "CG")}
        return Outcome(limits, {"creep": creep, "drops": drops, "grasps": grasps, "steps": steps} | falling)

    def table(self, data: Data) -> Table:
        table = Table("what | figure | |")
        for name, speed in data["creep"].items():
            table.add(f"creep, box on a slope of 20 degrees, {name} | {abs(speed):.2g} um/s")
        if "falling" in data:
            table.add(f"heap of {CROWD}, its first {FIRST:g} s, the dearest | costs {data['falling']:.2g} of native CG")
        for one in data["grasps"]:
            ends = "is held" if one["fell"] is None else f"falls after {one['fell']:.2g} s"
            table.add(f"{{what}}, shaken | slips {1e6 * abs(one['slip']):.1g} um in a minute; natively it {ends}", one)
        return table


def median_drop(seeds: Iterable[int], *heap: Any, native: str = "CG", **how: Any) -> dict[str, Any]:
    """The drop of a heap, see `sims.heap.costs`, with the median cost over the native one."""
    from sims.heap import costs

    found = [costs(*heap, seed=seed, solvers=(native,), **how) for seed in seeds]
    drops = sorted(found, key=lambda one: cost(one["drop"], native))
    return drops[len(drops) // 2]


def cost(times: dict[str, float], native: str) -> float:
    """Of the law over the engine's own contact."""
    return times["law"] / times[native]


def drop_limits(name: str, found: dict[str, Any], asked: float, native: str) -> list[Limit]:
    """Limits on the cost of the whole drop, and asleep."""
    out = [Limit(f"{name}, drop over {native}", asked, cost(found["drop"], native))]
    if found["lying"]:
        out.append(Limit(f"{name}, asleep over {native}", 0.3, cost(found["lying"], native)))
    return out
