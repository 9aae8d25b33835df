"""Every MJCF model of installed packages with the law for all contacts: whether it loads, stability, and cost.

    python -m validation.census gymnasium dm_control.suite --seconds 10

The results go to validation/data/census.json, which `validation.cases.models` reports. Run it from the project's root,
in an environment that has the package and its own MuJoCo. A model is driven by random actions for some time, or until
some processor time is spent; then it falls without actions, and its energy is recorded. If the law's run becomes
unstable, further seeds show how often each method does. Files that MuJoCo does not load by
themselves are parts of other models and are left out. Each file has a process of its own, forked from one that has all
compiled code, and a limit of processor time; those of few freedoms go first.
"""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

import argparse
import importlib.util
import json
import multiprocessing
import resource
import time
import warnings
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path
from typing import Any

FOUND = Path(__file__).parent / "data" / "census.json"
HOLD = 10  # steps that an action is held for
FALL = 2.0  # [s]
SEEDS = {"native": 60, "law": 10}  # further ones, where the first run with the law becomes unstable
PATIENCE = 10  # for these, over the limit of the first
EVERY_SHAPE = """<mujoco><asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset><worldbody>
<geom type="plane" size="1 1 1"/><body pos="0 0 9"><freejoint/><geom size="1"/></body>
<body pos="9 0 9"><joint/><geom type="capsule" size="1 1"/></body>
<body pos="9 9 9"><freejoint/><geom type="ellipsoid" size="1 1 2"/></body>
<body pos="0 9 9"><freejoint/><geom type="cylinder" size="1 1"/></body>
<body pos="0 18 9"><freejoint/><geom type="box" size="1 1 1"/></body>
<body pos="9 18 9"><freejoint/><geom type="mesh" mesh="m"/></body></worldbody></mujoco>"""


def files(package: str) -> Iterator[Path]:
    """The MJCF files of an installed package."""
    spec = importlib.util.find_spec(package)
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        for path in sorted(Path(folder).rglob("*.xml")):
            if "<mujoco" in path.read_text(errors="ignore"):
                yield path


def with_law(source: str, material: str = "rubber") -> Any:
    """A model with the law for all its contacts, of a material on steel."""
    from contactlaw import ContactPair
    from contactlaw.mujoco_plugin import load_model

    return load_model(source, [("*", "*", ContactPair(material, "steel", friction=0.8, restitution=0.5))])


def compiled() -> None:
    """Load all compiled code before any time is measured."""
    import mujoco

    from contactlaw.world.data.demand import IMPLICIT, SLEEP, SPIN, START_COASTING, supply

    model = with_law(EVERY_SHAPE)
    mujoco.mj_step(model, mujoco.MjData(model))
    for what in (IMPLICIT, START_COASTING, SLEEP, SPIN):
        supply(what)


def examine(path: str, seconds: float, budget: float) -> dict[str, Any]:
    """One model: how it lasts and what it costs, beside the engine's own contact."""
    import mujoco

    from contactlaw.mujoco_plugin import instances_of

    native = mujoco.MjModel.from_xml_path(path)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        begin = time.thread_time()
        law = with_law(path)
        load = time.thread_time() - begin
    out: dict[str, Any] = {
        "geoms": native.ngeom, "dofs": native.nv, "instances": len(instances_of(law)), "numbers": law.npluginstate,
        "said": [str(entry.message)[:160] for entry in said], "load": load,
    }  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        driven(mujoco, (native, law), 10.0 * native.opt.timestep, budget)
        out["seconds"], found = driven(mujoco, (native, law), seconds, budget)
        out["native"] = found[0] | fallen(mujoco, native, 0.5 * budget)
        out["law"] = found[1] | fallen(mujoco, law, 0.5 * budget)
    out["cost"] = out["law"]["us"] / out["native"]["us"]
    return out


def start(mujoco: Any, model: Any) -> Any:
    """A state to begin with: the model's first key, where there is one."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    return data


def often(path: str, seconds: float, budget: float) -> dict[str, Any]:
    """Number of runs with further seeds in which a model becomes unstable, and their total, for each method.

    budget: processor time [s] after which the law's are no more begun.
    """
    import mujoco

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        models, out = {"native": mujoco.MjModel.from_xml_path(path), "law": with_law(path)}, {}
        for way, model in models.items():
            bad: list[bool] = []
            begin = time.thread_time()
            while len(bad) < SEEDS[way] and (way == "native" or time.thread_time() - begin < budget):
                _, (found,) = driven(mujoco, (model,), seconds, float("inf"), 1 + len(bad))
                bad.append(found["unstable"] > 0)
            out[way] = {"bad": sum(bad), "runs": len(bad)}
    return {"often": out}


def driven(
    mujoco: Any, models: tuple[Any, ...], seconds: float, budget: float, seed: int = 0
) -> tuple[float, list[dict[str, Any]]]:
    """Random actions: for how long [s]; processor time of a step [us], how often the engine found the state unstable.

    The models take turns of a few steps, so that what else the machine does meets both. budget: processor time [s];
    it is the thread's that is read, as a process with a limit has its own told by the tick.
    """
    import numpy as np

    data, spent = [start(mujoco, model) for model in models], [0.0] * len(models)
    rngs = [np.random.default_rng(seed) for _ in models]
    steps, done = int(seconds / models[0].opt.timestep), 0
    while done < steps and sum(spent) < budget:
        count = min(HOLD, steps - done)
        done += count
        for i, (model, d, rng) in enumerate(zip(models, data, rngs, strict=True)):
            low, high = np.where(model.actuator_ctrllimited[:, None], model.actuator_ctrlrange, [-1.0, 1.0]).T
            if model.nu:
                d.ctrl[:] = rng.uniform(np.minimum(low, high), np.maximum(low, high))
            begin = time.thread_time()
            mujoco.mj_step(model, d, count)
            spent[i] += time.thread_time() - begin
    bad = [mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC]
    return done * models[0].opt.timestep, [
        {"us": 1e6 * time_spent / done, "unstable": int(sum(d.warning[kind].number for kind in bad))}
        for time_spent, d in zip(spent, data, strict=True)
    ]


def fallen(mujoco: Any, model: Any, budget: float) -> dict[str, float]:
    """A passive fall, for how long [s], and its greatest energy over that of the start, over the weight times 1 m.

    Shapes that overlap at the start are taken as pressed together, and joints that are beyond their limits there as
    springs: what they store is energy of the start.
    """
    data = start(mujoco, model)
    before = model.opt.disableflags, model.opt.enableflags
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    mujoco.mj_forward(model, data)
    first, greatest = float(data.energy.sum()) + stored(mujoco, model) + strained(mujoco, data), -float("inf")
    begin = time.thread_time()
    while data.time < FALL and time.thread_time() - begin < budget:
        mujoco.mj_step(model, data)
        greatest = max(greatest, float(data.energy.sum()))
    model.opt.disableflags, model.opt.enableflags = before
    gain = (greatest - first) / (9.81 * float(model.body_subtreemass[0]) + 1e-9)
    return {"gain": gain, "fall": float(data.time)}


def stored(mujoco: Any, model: Any) -> float:
    """Elastic energy [J] of the law's contacts at the start, 2/5 P delta each, P as a step of 1 us begins with it."""
    from contactlaw.mujoco_plugin import contacts_of, instances_of

    data, step = start(mujoco, model), model.opt.timestep
    model.opt.timestep = 1e-6
    mujoco.mj_step(model, data)
    model.opt.timestep = step
    found = [c for name in instances_of(model) for c in contacts_of(model, data, name)]
    return 0.4 * sum(c.normal_force * c.overlap for c in found)


def strained(mujoco: Any, data: Any) -> float:
    """Elastic energy [J] of joint limits that are passed at the start, w K I r^2/2 each.

    A soft constraint asks for the acceleration -K I r beyond its limit by r, and of a joint of which 1/A is the mass
    that answers, with nothing in its way, it gives the force w K I r, w = D/(1 + D A) = D (1 - I), as 1/D = (1 - I)/I A
    (MuJoCo documentation, Computation, "Solver parameters"). What contacts stop it pushes harder.
    """
    joints = data.efc_type == mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT
    stiffness, _, impedance, _ = data.efc_KBIP.reshape(-1, 4)[joints].T
    weight = data.efc_D[joints] * (1.0 - impedance)
    return float(0.5 * (weight * stiffness * impedance * (data.efc_pos - data.efc_margin)[joints] ** 2).sum())


def moving(paths: list[Path]) -> list[Path]:
    """The files that MuJoCo loads by themselves and in which something moves, those of few freedoms first."""
    import mujoco

    known = []
    for path in paths:
        try:
            model = mujoco.MjModel.from_xml_path(str(path))
        except ValueError:
            continue
        if model.ngeom and model.nv:
            known.append((model.nv, path))
    return [path for _, path in sorted(known)]


def work(pipe: Any, what: Callable[..., Any], asked: tuple[Any, ...], limit: float) -> None:
    """Look at a model within so much processor time [s]: what a process of its own does."""
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit + time.process_time()), resource.RLIM_INFINITY))
    try:
        pipe.send(what(*asked))
    except Exception as error:  # whatever a model does, the next one has its turn
        pipe.send({"failed": f"{type(error).__name__}: {error}"[:120]})


def told(what: Callable[..., Any], path: Path, seconds: float, limit: float) -> dict[str, Any]:
    """What a model does, looked at by a process of its own."""
    here, there = multiprocessing.Pipe()
    asked = str(path), seconds, 0.3 * limit
    process = multiprocessing.get_context("fork").Process(target=work, args=(there, what, asked, limit))
    process.start()
    there.close()
    try:
        return here.recv()
    except EOFError:
        process.join()
        slow = process.exitcode == -24  # SIGXCPU
        return {"failed": f"took longer than {limit:g} s" if slow else f"ended with {process.exitcode}"}


def versions(package: str) -> str:
    """Of a package and of the MuJoCo beside it."""
    names = []
    for name in (package.split(".")[0].replace("_", "-"), "mujoco"):
        try:
            names.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            names.append(name)
    return ", ".join(names)


def main() -> None:
    """Examine all models of packages; what is known of other packages stays."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("packages", nargs="*")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--limit", type=float, default=60.0, help="processor time of a model, in all [s]")
    parser.add_argument("--only", default="", help="a part of the path")
    asked = parser.parse_args()
    compiled()
    known = json.loads(FOUND.read_text()) if FOUND.exists() else {"rows": [], "left": {}}
    rows, left = known["rows"], known["left"]
    for package in asked.packages:
        paths = [path for path in moving(list(files(package))) if asked.only in str(path)]
        if not asked.only:
            rows = [row for row in rows if row["package"] != package]
        for number, path in enumerate(paths, 1):
            row = {"package": package, "name": f"{path.parent.name}/{path.name}", "versions": versions(package)}
            rows = [other for other in rows if (other["package"], other["name"]) != (package, row["name"])]
            row |= told(examine, path, asked.seconds, asked.limit)
            if "law" in row and row["law"]["unstable"]:
                row["often"] = told(often, path, row["seconds"], PATIENCE * asked.limit).get("often")
            rows.append(row)
            print(f"{package}/{row['name']} {row.get('failed') or round(row['cost'], 2)}", flush=True)
            if not asked.only:
                left[package] = len(paths) - number  # that a run which was stopped has not come to
            FOUND.write_text(json.dumps({"left": left, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
