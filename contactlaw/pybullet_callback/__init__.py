"""The law in PyBullet: a `ContactCallback` that the user's loop calls before each `stepSimulation`."""

from contactlaw.pybullet_callback.callback import ContactCallback
from contactlaw.pybullet_callback.contact import ContactState, Ledger

__all__ = ["ContactCallback", "ContactState", "Ledger"]
