"""The law in PyBullet: a `ContactCallback` that the user's loop calls before each `stepSimulation`."""

from contactlaw.pybullet_callback.callback import ContactCallback
from contactlaw.pybullet_callback.contact import ContactState, Ledger
from contactlaw.pybullet_callback.drop_in import Loaded, links_of, load_urdf

__all__ = ["ContactCallback", "ContactState", "Ledger", "Loaded", "links_of", "load_urdf"]
