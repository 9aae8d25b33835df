"""The law in PyBullet: a `ContactCallback`, which takes the steps in place of `stepSimulation`."""

from contactlaw import checks

checks.need("pybullet", "contactlaw.pybullet_callback", "pybullet")

from contactlaw.pybullet_callback.callback import ContactCallback  # noqa: E402
from contactlaw.pybullet_callback.contact import ContactState  # noqa: E402
from contactlaw.pybullet_callback.drop_in import Loaded, links_of, load_urdf  # noqa: E402
from contactlaw.world.readout import Ledger  # noqa: E402

__all__ = ["ContactCallback", "ContactState", "Ledger", "Loaded", "links_of", "load_urdf"]
