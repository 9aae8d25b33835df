"""Every MJCF model of installed packages with the law for all its contacts: does it load, last, and what does it cost.

    python -m validation.census gymnasium dm_control.suite --seconds 10

It leaves what it found in validation/data/census.json, of which `validation.cases.models` makes a chapter. Run it in
an environment that has the package and its own MuJoCo, from the project's root. A model is driven by random
actions; then it falls without any, and its energy is looked at. Files that MuJoCo does not load by themselves are parts
of other models and are left out. Each file has a process of its own and a limit of time.
"""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import argparse
import importlib.util
import json
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any

FOUND = Path(__file__).parent / "data" / "census.json"
HOLD = 10  # steps that an action is held for


def files(package: str) -> Iterator[Path]:
    """The MJCF files of an installed package."""
    spec = importlib.util.find_spec(package)
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        for path in sorted(Path(folder).rglob("*.xml")):
            if "<mujoco" in path.read_text(errors="ignore"):
                yield path


def examine(path: str, seconds: float) -> dict[str, Any]:
    """One model: how it lasts and what it costs, beside the engine's own contact."""
    import mujoco

    from contactlaw import MATERIALS, ContactPair
    from contactlaw.mujoco_plugin import instances_of, load_model
    from contactlaw.world.demand import LAST, LIMIT, TWIST, supply

    try:
        native = mujoco.MjModel.from_xml_path(path)
    except ValueError as error:
        return {"left_out": str(error).strip().splitlines()[0][:80]}
    if native.ngeom == 0 or native.nv == 0:
        return {"left_out": "nothing moves"}
    rubber = MATERIALS["rubber"]
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        law = load_model(path, [("*", "*", ContactPair(rubber, MATERIALS["steel"], friction=0.8, restitution=0.5))])
    out: dict[str, Any] = {
        "geoms": native.ngeom, "dofs": native.nv, "instances": len(instances_of(law)), "numbers": law.npluginstate,
        "said": [str(entry.message)[:160] for entry in said],
    }  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for what in (LAST, LIMIT, TWIST):  # compiled, or read, before any clock runs
            supply(what)
        driven(mujoco, (native, law), 10.0 * native.opt.timestep)
        found = driven(mujoco, (native, law), seconds)
        out["native"] = found[0] | fallen(mujoco, native)
        out["law"] = found[1] | fallen(mujoco, law)
    out["cost"] = out["law"]["us"] / out["native"]["us"]
    return out


def start(mujoco: Any, model: Any) -> Any:
    """A state to begin with: the model's first key, where there is one."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    return data


def driven(mujoco: Any, models: tuple[Any, Any], seconds: float) -> list[dict[str, Any]]:
    """Random actions: processor time of a step [us], and how often the engine found the state unstable.

    The models take turns of a few steps, so that what else the machine does meets both.
    """
    import numpy as np

    data, spent = [start(mujoco, model) for model in models], [0.0, 0.0]
    rngs = [np.random.default_rng(0) for _ in models]
    steps = int(seconds / models[0].opt.timestep)
    for step in range(0, steps, HOLD):
        for i, (model, d, rng) in enumerate(zip(models, data, rngs, strict=True)):
            low, high = np.where(model.actuator_ctrllimited[:, None], model.actuator_ctrlrange, [-1.0, 1.0]).T
            if model.nu:
                d.ctrl[:] = rng.uniform(np.minimum(low, high), np.maximum(low, high))
            begin = time.process_time()
            mujoco.mj_step(model, d, min(HOLD, steps - step))
            spent[i] += time.process_time() - begin
    bad = [mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC]
    return [
        {"us": 1e6 * time_spent / steps, "unstable": int(sum(d.warning[kind].number for kind in bad))}
        for time_spent, d in zip(spent, data, strict=True)
    ]


def fallen(mujoco: Any, model: Any) -> dict[str, float]:
    """A passive fall of 2 s: greatest energy over that of the start, over the weight times 1 m."""
    data = start(mujoco, model)
    before = model.opt.disableflags, model.opt.enableflags
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    mujoco.mj_forward(model, data)
    first, greatest = float(data.energy.sum()), -float("inf")
    for _ in range(int(2.0 / model.opt.timestep)):
        mujoco.mj_step(model, data)
        greatest = max(greatest, float(data.energy.sum()))
    model.opt.disableflags, model.opt.enableflags = before
    return {"gain": (greatest - first) / (9.81 * float(model.body_subtreemass[0]) + 1e-9)}


def told(package: str, path: Path, seconds: float, limit: float) -> dict[str, Any]:
    """What a model does, examined by a process of its own."""
    row: dict[str, Any] = {"package": package, "name": path.name}
    command = [sys.executable, "-m", "validation.census", "--one", str(path), "--seconds", str(seconds)]
    try:
        run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=limit)
    except subprocess.TimeoutExpired:
        return row | {"failed": f"took longer than {limit:g} s"}
    if run.returncode != 0:
        return row | {"failed": (run.stderr.strip().splitlines() or ["no word"])[-1][:120]}
    return row | json.loads(run.stdout.splitlines()[-1])


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
    parser.add_argument("--limit", type=float, default=600.0, help="of a model, in all [s]")
    parser.add_argument("--one", help="a single file, as JSON")
    asked = parser.parse_args()
    if asked.one:
        print(json.dumps(examine(asked.one, asked.seconds)))
        return
    known = json.loads(FOUND.read_text()) if FOUND.exists() else {"rows": [], "left": {}}
    rows, left = known["rows"], known["left"]
    for package in asked.packages:
        rows = [row for row in rows if row["package"] != package]
        paths = list(files(package))
        for number, path in enumerate(paths, 1):
            row = told(package, path, asked.seconds, asked.limit)
            if "left_out" not in row:
                rows.append(row | {"versions": versions(package), "seconds": asked.seconds})
                print(f"{package}/{path.name} {row.get('failed') or round(row['cost'], 2)}", flush=True)
            left[package] = len(paths) - number  # files that a run which was stopped has not come to
            FOUND.write_text(json.dumps({"left": left, "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
