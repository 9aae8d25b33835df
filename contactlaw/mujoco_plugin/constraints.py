"""The engine's constraint stage, switched off where the law leaves it nothing to do."""

from itertools import combinations_with_replacement, product

import mujoco

from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.instances import contact_instances, native_rule
from contactlaw.mujoco_plugin.shapes import touch
from contactlaw.world.near.sets import groups

FREE = int(mujoco.mjtJoint.mjJNT_FREE)
OFF = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)


def skip_constraints(model: mujoco.MjModel) -> bool:
    """Switch the engine's constraint stage off if the law makes all contacts of the model, and all joints are free.

    The stage takes a fifth of the step of a single body even where it finds nothing, and stack memory that grows as the
    square of the number of bodies. It goes off by mjDSBL_CONSTRAINT in `model.opt.disableflags`, to which the law pays
    no heed. `load_model` calls this; after `spec.compile()` the user may. Clear the flag before `geom_contype` or
    `geom_conaffinity` is edited to let the engine make contacts again.

    Returns:
        Whether the stage is off.
    """
    view = layout.view_of(model)
    bound = view.neq or view.ntendon or view.nflex or (view.jnt_type != FREE).any() or view.dof_frictionloss.any()
    if contact_instances(view) and not bound and not _makes_contacts(view):
        model.opt.disableflags |= OFF
    return bool(model.opt.disableflags & OFF)


def _makes_contacts(view: layout.ModelView) -> bool:
    """Return whether the engine may make a contact by itself between any two geoms."""
    if (view.pair_margin >= 0.0).any():
        return True
    weld, is_native = view.body_weldid[view.geom_bodyid].tolist(), native_rule(view)
    kinds = groups(range(view.ngeom), lambda geom: (view.bits[geom], weld[geom] == 0))
    return any(
        weld[a] != weld[b] and is_native((a, b))
        for one, two in combinations_with_replacement(kinds, 2)
        if touch(one[0], two[0]) and not (one[1] and two[1])
        for a, b in product(kinds[one], kinds[two])
    )
