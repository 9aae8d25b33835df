"""The law as a MuJoCo engine plugin: `add_contact`, then `spec.compile()` and unmodified `mj_step`, at any time step.

Importing this module registers the plugin; XML may then name it:

    <extension><plugin plugin="contactlaw.contact"><instance name="bounce">
      <config key="geom1" value="ball"/> <config key="geom2" value="floor"/>
      <config key="material1" value="steel"/> <config key="material2" value="2.1e11 0.3"/>
      <config key="friction" value="0.1"/> <config key="restitution" value="0.9"/>
    </instance></plugin></extension>
    <contact><pair geom1="ball" geom2="floor" margin="-1e6"/></contact>

Keys: see `config.KEYS`. The explicit pair with its negative margin turns the native contact of these two geoms off.
"""

from contactlaw import checks

checks.need("mujoco", "contactlaw.mujoco_plugin", "mujoco")

from contactlaw.mujoco_plugin.plugin import register  # noqa: E402

register()

from contactlaw.mujoco_plugin.drop_in import load_model, model_xml, save_model  # noqa: E402
from contactlaw.mujoco_plugin.geoms import geoms_of  # noqa: E402
from contactlaw.mujoco_plugin.instances import skip_constraints  # noqa: E402
from contactlaw.mujoco_plugin.readout import (  # noqa: E402
    ContactState,
    Ledger,
    contact_wrenches,
    contacts_of,
    instances_of,
    ledger_of,
    overlaps_of,
    set_friction,
)
from contactlaw.mujoco_plugin.spec import add_contact  # noqa: E402

__all__ = [
    "ContactState", "Ledger", "add_contact", "contact_wrenches", "contacts_of", "geoms_of", "instances_of", "ledger_of",
    "load_model", "model_xml", "overlaps_of", "save_model", "set_friction", "skip_constraints",
]  # fmt: skip
