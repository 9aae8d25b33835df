"""contactlaw: oblique elastic impact with stick and slip inside the contact, for rigid-body engines.

Units are SI; vectors are in the world frame; a contact normal points from body B to body A and forces act on A.
"""

from contactlaw.calibration import Calibration, Estimate, calibrate, contact_velocities
from contactlaw.collision import Body, Impact, collide
from contactlaw.impact import force_along_path, rebound
from contactlaw.laws import LAWS, Law
from contactlaw.material import MATERIALS, RIGID, Material
from contactlaw.pair import ContactPair, ContactWarning

__all__ = [
    "LAWS", "MATERIALS", "RIGID", "Body", "Calibration", "ContactPair", "ContactWarning", "Estimate", "Impact", "Law",
    "Material", "calibrate", "collide", "contact_velocities", "force_along_path", "rebound",
]  # fmt: skip
__version__ = "0.2.0"
