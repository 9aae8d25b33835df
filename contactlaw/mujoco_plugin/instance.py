"""A plugin instance comes to life: what MuJoCo asks of Python when a model is compiled and when an mjData is made."""

# The wheel describes little of what it exports.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import ctypes
import sys
import warnings
from math import inf

import mujoco
import numpy as np

from contactlaw.mujoco_plugin import callbacks as c
from contactlaw.mujoco_plugin import config, layout
from contactlaw.mujoco_plugin.shapes import Meeting, Shape, meeting
from contactlaw.pair import DEEPEST, ContactWarning, rounded_down

_LIBRARY = layout.library()
_LIBRARY.mj_getPluginConfig.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p]
_LIBRARY.mj_getPluginConfig.restype = ctypes.c_char_p
_LIBRARY.mj_name2id.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p]
_LIBRARY.mj_id2name.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int]
_LIBRARY.mj_id2name.restype = ctypes.c_char_p
_LIBRARY.mju_malloc.argtypes = [ctypes.c_size_t]
_LIBRARY.mju_malloc.restype = ctypes.c_void_p

_NO_PASSIVE = int(mujoco.mjtDisableBit.mjDSBL_SPRING) | int(mujoco.mjtDisableBit.mjDSBL_DAMPER)


def contact_of(model: int, number: int) -> config.Contact:
    """The contact that a plugin instance of the model at this address is configured for."""
    items = ((key, _LIBRARY.mj_getPluginConfig(model, number, key.encode())) for key in config.KEYS)
    return config.read(tuple((key, value.decode()) for key, value in items if value))


class _Instance:
    """What a compiled model says of one contact."""

    def __init__(self, model: int, number: int) -> None:
        self.view = layout.ModelView(model)
        self.contact = contact_of(model, number)
        names = self._names(model, number)
        self.geoms = [self._geom(key, name) for key, name in zip(("geom1", "geom2"), names, strict=True)]
        if self.geoms[0] == self.geoms[1]:
            raise ValueError(f"geom2 = {names[1]!r}: must be another geom than geom1")
        shapes = [self._shape(name, geom) for name, geom in zip(names, self.geoms, strict=True)]
        self.meeting: Meeting = meeting(shapes[0], shapes[1], self.contact.pair.radius)
        if self.meeting.swapped:
            self.geoms.reverse()
            shapes.reverse()
        self.shapes = shapes

    @property
    def state_size(self) -> int:
        """Entries in plugin_state."""
        return self.meeting.slots * self.contact.history_size

    def _names(self, model: int, number: int) -> list[str]:
        """The geoms' names, with the prefix and suffix that attaching the model to another one has put to all names."""
        geoms = [self.contact.geom1, self.contact.geom2]
        own = _LIBRARY.mj_id2name(model, int(mujoco.mjtObj.mjOBJ_PLUGIN), number)
        prefix, found, suffix = (own or b"").decode().partition(config.instance_name(*geoms))
        return [prefix + name + suffix for name in geoms] if found else geoms

    def _geom(self, key: str, name: str) -> int:
        number = _LIBRARY.mj_name2id(self.view.address, int(mujoco.mjtObj.mjOBJ_GEOM), name.encode())
        if number < 0:
            raise ValueError(f"{key} = {name!r}: must be the name of a geom of the model")
        return number

    def _shape(self, name: str, geom: int) -> Shape:
        count = self.view.size("ngeom")
        sizes = self.view.doubles("geom_size", 3 * count)[3 * geom : 3 * geom + 3]
        return Shape(name, int(self.view.ints("geom_type", count)[geom]), sizes.copy())

    def body(self, geom: int) -> tuple[int, int, int]:
        """A geom's body, the root of its tree, and the last degree of freedom that moves it, -1 if none does."""
        view = self.view
        body = int(view.ints("geom_bodyid", geom + 1)[geom])
        count = view.size("nbody")
        root = int(view.ints("body_rootid", count)[body])
        parent, first, number = (view.ints(f, count) for f in ("body_parentid", "body_dofadr", "body_dofnum"))
        moving = body
        while moving and number[moving] == 0:
            moving = int(parent[moving])
        return body, root, int(first[moving] + number[moving] - 1) if moving else -1

    def block(self, state_address: int) -> np.ndarray:
        """The memory that the compiled callbacks work with, as `callbacks` lays it out."""
        p = self.contact.pair.parameters(self.meeting.radius, self.contact.plane)
        nv = self.view.size("nv")
        b = np.zeros(c.PARAMETERS_AT + p.size + self.state_size + c.WORK + 3 * nv)
        (body_a, root_a, dof_a), (body_b, root_b, dof_b) = (self.body(geom) for geom in self.geoms)
        if dof_a < 0 and dof_b < 0:
            raise ValueError(f"geom1, geom2: neither {self.shapes[0].label} nor {self.shapes[1].label} can move")
        a, other = self.shapes
        bound = a.bound if self.meeting.kind == c.BALL_ON_PLANE else a.bound + other.bound
        values = {
            c.REPORT: REPORT_ADDRESS, c.KIND: self.meeting.kind, c.SLOTS: self.meeting.slots,
            c.HISTORY: self.contact.history_size, c.PARAMETER_COUNT: p.size, c.NV: nv, c.STATE: state_address,
            c.RADIUS_GIVEN: self.contact.pair.radius is not None, c.GEOM_A: self.geoms[0], c.GEOM_B: self.geoms[1],
            c.BODY_A: body_a, c.BODY_B: body_b, c.ROOT_A: root_a, c.ROOT_B: root_b, c.DOF_A: dof_a, c.DOF_B: dof_b,
            c.BALL_A: a.size[0], c.BALL_B: other.size[0], c.HALF_A: a.half_length, c.HALF_B: other.half_length,
            c.BOUND: bound if np.isfinite(bound) else 1e300,
        }  # fmt: skip
        for index, value in values.items():
            b[index] = value
        b[c.BOX : c.BOX + 3] = other.size
        b[c.PARAMETERS_AT : c.PARAMETERS_AT + p.size] = p
        return b

    def check_native(self) -> None:
        """The engine's own contact of these geoms must be off, or both would push."""
        view, count = self.view, self.view.size("ngeom")
        contype, affinity = view.ints("geom_contype", count), view.ints("geom_conaffinity", count)
        one, two = self.geoms
        pairs = view.size("npair")
        first, second = view.ints("pair_geom1", pairs), view.ints("pair_geom2", pairs)
        mine = ((first == one) & (second == two)) | ((first == two) & (second == one))
        if mine.any():
            if view.doubles("pair_margin", pairs)[mine].max() < 0.0:
                return
        else:
            bodies = sorted(self.body(geom)[0] for geom in self.geoms)
            excluded = view.ints("exclude_signature", view.size("nexclude"))
            if (bodies[0] << 16) + bodies[1] in excluded:
                return
            if not (contype[one] & affinity[two]) and not (contype[two] & affinity[one]):
                return
        names, margin = [shape.name for shape in self.shapes], native_margin(*self.shapes)
        raise ValueError(
            f"geom1 = {names[0]!r}, geom2 = {names[1]!r}: the engine's own contact of this pair is on; turn it off by "
            f'<contact><pair geom1="{names[0]}" geom2="{names[1]}" margin="{-margin:g}"/></contact>'
        )


def native_margin(one: Shape, two: Shape) -> float:
    """Margin, to be negated, of an explicit pair that the engine's bounding test always rejects."""
    bounds = [shape.bound for shape in (one, two)]
    # Bounding spheres are compared by squares: only a sum of exactly zero rejects all. Planes are compared signed.
    return sum(bounds) if max(bounds) < inf else 1e6


def _complain(number: int, error: Exception) -> None:
    """Errors cannot cross MuJoCo's C frames: the message goes out here, and MuJoCo then fails by itself."""
    print(f"contactlaw: plugin instance {number}: {error}", file=sys.stderr)


@ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_int)
def nstate(model: int, number: int) -> int:
    """Size of the state of an instance, called when a model is compiled."""
    try:
        return _Instance(model, number).state_size
    except Exception:  # `init` comes next, fails in the same way and says why
        return 0


@ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int)
def init(model: int, data: int, number: int) -> int:
    """Fill the block of an instance, called when an mjData is made."""
    try:
        instance = _Instance(model, number)
        instance.check_native()
        if instance.view.option("integrator") == int(mujoco.mjtIntegrator.mjINT_RK4):
            raise ValueError("integrator = RK4: must be Euler, implicit or implicitfast; RK4 moves inside its step")
        if instance.view.option("enableflags") & int(mujoco.mjtEnableBit.mjENBL_SLEEP):
            raise ValueError("enableflags: sleep must be off; a body that is struck by the law would not wake")
        if instance.view.option("disableflags") & _NO_PASSIVE == _NO_PASSIVE:
            raise ValueError("disableflags: spring and damper are both disabled, and with them all passive forces")
        address = int(instance.view.ints("plugin_stateadr", number + 1)[number])
        block = instance.block(address)
        memory = _LIBRARY.mju_malloc(block.nbytes)
        ctypes.memmove(memory, block.ctypes.data, block.nbytes)
        blocks = ctypes.c_size_t.from_address(data + layout.DATA["plugin_data"]).value
        ctypes.c_size_t.from_address(blocks + 8 * number).value = memory
    except Exception as error:
        _complain(number, error)
        return -1
    return 0


@ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64, ctypes.c_double)
def _report(number: int, code: int, value: float) -> None:
    """Something that a compiled callback noticed, once for each instance and mjData."""
    if code == c.LONG_STEP:
        text = f"the time step does not resolve the contact: use {rounded_down(value):.3g} s or less"
    elif code == c.DEEP:
        text = f"overlap over radius is {value:.2g}: beyond {DEEPEST} Hertz contact is no longer right"
    elif code == c.UNCLEAR_RADIUS:
        text = (
            f"touching at an edge or the side of a capsule, with R = {value:.3g} m taken from the ball or capsule; "
            "give the pair its radius"
        )
    else:
        text = "the contact normal is not in the plane of motion that the contact was given: no force acts"
    warnings.warn(f"contact of plugin instance {number}: {text}", ContactWarning, stacklevel=2)


REPORT_ADDRESS = ctypes.cast(_report, ctypes.c_void_p).value or 0
