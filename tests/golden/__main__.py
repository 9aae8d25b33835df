"""Make the golden file anew, for a change that is meant, and say what changed and by how much.

Numbers within the tolerance stay as they are in the file, and so do the runs of an engine that is not installed.
"""

from importlib.util import find_spec

from tests.golden import store
from tests.golden.runs import RUNS

old = store.load()
new: dict[str, store.Kept] = {}
for name, run in RUNS.items():
    if run.engine and find_spec(run.engine) is None:
        print(f"not run, there is no {run.engine}: {name}")
        new |= {name: old[name]} if name in old else {}
        continue
    found = store.numbers_of(run)
    changed = store.changes(old[name], found, run.tolerance) if name in old else ["new"]
    new[name] = found if changed else old[name]
    for line in changed:
        print(f"{name}: {line}")
for name in old.keys() - new.keys():
    print(f"{name}: gone")
store.save(new)
print(f"{sum(old.get(name) == new[name] for name in new)} of {len(new)} runs as they were")
