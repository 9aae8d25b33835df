"""The plugin imported a second time in a process: MuJoCo takes a plugin of a name once, and ends the process else."""

import subprocess
import sys

import pytest

pytest.importorskip("mujoco")

RUN = """
import gc, importlib, sys, warnings
import mujoco, numpy as np
import contactlaw.mujoco_plugin as plugin
XML = '''<mujoco><option timestep="1e-3" gravity="0 0 0"/><worldbody><geom name="floor" type="plane" size="1 1 1"/>
<body pos="0 0 .03"><freejoint/><geom name="ball" size=".025" density="7800"/></body></worldbody></mujoco>'''

def make(material="steel"):
    law = sys.modules["contactlaw"]
    pair = law.ContactPair(law.MATERIALS[material], law.MATERIALS[material], friction=0.3, restitution=0.8)
    model = plugin.load_model(XML, [("ball", "floor", pair)])
    data = mujoco.MjData(model)
    data.qvel[2] = -1.0
    return model, data

def bounce(model, data):
    mujoco.mj_step(model, data, 20)
    assert abs(data.qvel[2] - 0.8) < 1e-3, data.qvel

old = make()
bounce(*make())
FORGET
gc.collect()
bounce(*old)
bounce(*make())
model, data = make("rubber")
data.qvel[2] = -10.0
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    mujoco.mj_step(model, data, 20)
assert said and said[0].category is sys.modules["contactlaw"].ContactWarning, said
print("end reached")
"""
AGAIN = """
for name in [name for name in sys.modules if name.startswith("contactlaw")]:
    del sys.modules[name]
del plugin
import contactlaw.mujoco_plugin as plugin
"""
RELOAD = """
importlib.reload(plugin)
"""


def run(forget):
    return subprocess.run(
        [sys.executable, "-c", RUN.replace("FORGET", forget)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.mark.parametrize("forget", [AGAIN, 2 * AGAIN, RELOAD], ids=["again", "twice", "reload"])
def test_the_plugin_is_taken_over(forget):
    done = run(forget)
    assert done.returncode == 0 and "end reached" in done.stdout, done.stderr


def test_another_version_is_refused():
    other = AGAIN.replace(
        "del plugin\n", "del plugin\nimport contactlaw.jit\ncontactlaw.jit.SOURCE_STAMP += 'another'\n"
    )
    done = run(other)
    assert "ImportError: the plugin contactlaw.contact is registered in this process already" in done.stderr
