"""What should not change does not: every golden run gives the numbers that the file has.

`tests.golden.runs` makes the runs. For a change that is meant, `python -m tests.golden` makes the file anew and says
what changed and by how much.
"""

import pytest

from contactlaw import ContactPair
from tests.golden import store
from tests.golden.runs import RUNS

GOLDEN = store.load()
NAMES = [
    pytest.param(name, marks=pytest.mark.heavy if name in RUNS and RUNS[name].engine else ())
    for name in sorted(RUNS | GOLDEN)
]


def changes(name):
    return store.changes(GOLDEN[name], store.numbers_of(RUNS[name]), RUNS[name].tolerance)


@pytest.mark.parametrize("name", NAMES)
def test_a_run_gives_what_it_gave(name):
    assert name in RUNS, store.why_gone(name)
    assert name in GOLDEN, f"golden run {name!r} is new: `{store.COMMAND}` adds it to the file"
    if RUNS[name].engine:
        pytest.importorskip(RUNS[name].engine)
    said = changes(name)
    assert not said, f"{name}: " + "; ".join(said)


def test_a_change_of_a_millionth_in_the_stiffness_is_seen(monkeypatch):
    kappa = property(lambda pair: 1.000001 * pair.effective_shear_modulus / pair.effective_modulus)
    monkeypatch.setattr(ContactPair, "kappa", kappa)
    assert any(said.startswith("velocity") for said in changes("collide-ball-on-plane/microslip"))


def test_a_law_that_is_gone_is_named():
    assert "'glue' is none of the laws" in store.why_gone("rest/mujoco-euler/glue")
    assert "runs.py does not make it" in store.why_gone("no-such-scene/mujoco-euler/microslip")
