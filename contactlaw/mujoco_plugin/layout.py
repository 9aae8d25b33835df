"""Where MuJoCo keeps its fields: offsets derived from the wheel's own description, checked against live arrays."""

from __future__ import annotations

import ctypes
import hashlib
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco.introspect import ast_nodes, structs

_NUMBERS: dict[str, Any] = {
    "int": ctypes.c_int,
    "unsigned int": ctypes.c_uint,
    "float": ctypes.c_float,
    "double": ctypes.c_double,
    "char": ctypes.c_char,
    "mjtNum": ctypes.c_double,
    "mjtByte": ctypes.c_ubyte,
    "mjtBool": ctypes.c_ubyte,
    "mjtSize": ctypes.c_int64,
    "uint64_t": ctypes.c_uint64,
    "int64_t": ctypes.c_int64,
    "size_t": ctypes.c_size_t,
    "uintptr_t": ctypes.c_size_t,
}

DATA_FIELDS = (
    "plugin_state", "plugin_data", "time", "qpos", "qvel", "qfrc_passive", "qfrc_applied", "qfrc_actuator",
    "qfrc_constraint", "qfrc_smooth", "qfrc_bias", "qDeriv", "xfrc_applied", "xpos", "xquat",
    "qacc", "sensordata", "geom_xpos", "geom_xmat", "xipos", "site_xpos", "site_xmat",
    "efc_id", "efc_type", "efc_pos", "efc_margin", "efc_KBIP", "efc_D", "efc_force",
)  # fmt: skip
MODEL_FIELDS = (
    "dof_damping", "dof_armature", "dof_treeid", "geom_type", "geom_size", "geom_bodyid", "geom_pos", "geom_quat",
    "geom_rbound", "geom_dataid", "mesh_vertadr", "mesh_vertnum", "mesh_vert", "mesh_graphadr", "mesh_graph",
    "geom_contype", "geom_conaffinity", "geom_friction", "geom_priority", "body_parentid", "body_weldid", "body_treeid",
    "body_plugin",
    "body_rootid", "body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_subtreemass",
    "body_inertia", "body_mocapid", "body_jntadr", "body_jntnum", "body_dofadr", "body_dofnum", "jnt_type",
    "jnt_qposadr", "jnt_dofadr", "jnt_pos", "jnt_axis", "qpos0", "pair_geom1", "pair_geom2", "pair_margin",
    "exclude_signature", "plugin", "plugin_stateadr", "D_rowadr", "D_diag", "jnt_range", "site_bodyid", "site_type",
    "site_size", "sensor_type", "sensor_needstage", "sensor_objtype", "sensor_objid", "sensor_adr", "sensor_cutoff",
    "sensor_plugin",
)  # fmt: skip


def _ctype(node: Any) -> Any:
    if isinstance(node, ast_nodes.PointerType):
        return ctypes.c_void_p
    if isinstance(node, ast_nodes.ArrayType):
        kind = _ctype(node.inner_type)
        for extent in reversed(node.extents):
            kind = kind * extent
        return kind
    if isinstance(node, ast_nodes.AnonymousStructDecl):
        return _laid_out("anonymous", node.fields)
    if isinstance(node, ast_nodes.ValueType):
        if node.name in _NUMBERS:
            return _NUMBERS[node.name]
        if node.name in structs.STRUCTS:
            return structure(node.name)
        if node.name.startswith("mjt"):  # the remaining types of this prefix are enums
            return ctypes.c_int
    raise ImportError(f"contactlaw does not know the type {node} in the structs of MuJoCo {mujoco.__version__}")


@cache
def structure(name: str) -> type[ctypes.Structure]:
    """A MuJoCo struct as ctypes lays it out."""
    return _laid_out(name, structs.STRUCTS[name].fields)


def _laid_out(name: str, fields: Any) -> type[ctypes.Structure]:
    return type(name, (ctypes.Structure,), {"_fields_": [(field.name, _ctype(field.type)) for field in fields]})


def offset(struct: str, field: str) -> int:
    """Byte offset of a field."""
    return getattr(structure(struct), field).offset


DATA = {field: offset("mjData", field) for field in DATA_FIELDS}
MODEL = {field: offset("mjModel", field) for field in MODEL_FIELDS}
EQUALITIES, FRICTIONS, LIMITS = (offset("mjData", count) for count in ("ne", "nf", "nl"))
JOINT_LIMIT = int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
DISABLED = offset("mjModel", "opt") + offset("mjOption", "disableflags")
TIMESTEP = offset("mjModel", "opt") + offset("mjOption", "timestep")
INTEGRATOR = offset("mjModel", "opt") + offset("mjOption", "integrator")
GRAVITY = offset("mjModel", "opt") + offset("mjOption", "gravity")
NO_GRAVITY = int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
NO_CONTACT = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
NO_PASSIVE = int(mujoco.mjtDisableBit.mjDSBL_SPRING) | int(mujoco.mjtDisableBit.mjDSBL_DAMPER)
"""Where both are set passive forces, and with them the plugin's, are not computed."""
RUNGE_KUTTA = int(mujoco.mjtIntegrator.mjINT_RK4)
IMPLICITFAST = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
LOSES_SPIN = (3, 7) <= tuple(int(part) for part in mujoco.__version__.split(".")[:2]) <= (3, 10)
"""These let `implicitfast` undo what a plugin writes to the angular velocity of free bodies."""
SLEEP = int(getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0))  # from 3.5
SENSOR_SYMBOLS = ("mj_rnePostConstraint", "mj_sensorAcc", "mj_applyFT", "mj_solveM", "mju_rayGeom")
SENSOR = int(mujoco.mjtPluginCapabilityBit.mjPLUGIN_SENSOR)
_OFFSETS = DISABLED, TIMESTEP, INTEGRATOR, GRAVITY, MODEL, EQUALITIES, FRICTIONS, LIMITS
KEY = repr((mujoco.__version__, DATA, _OFFSETS))
"""What compiled code that knows the offsets depends on."""


class ModelView:
    """A compiled model at an address, as the callbacks get it: sizes as whole numbers, arrays as views, by name."""

    def __init__(self, address: int) -> None:
        self.address = address

    def __getattr__(self, name: str) -> Any:
        if name not in _MODEL:
            raise AttributeError(name)
        at, own = self.address + offset("mjModel", name), _MODEL[name]
        if not own.array_extent:
            return int(getattr(structure("mjModel").from_address(self.address), name))
        shape = [extent if isinstance(extent, int) else getattr(self, extent) for extent in own.array_extent]
        kind, count = _NUMBERS[own.type.inner_type.name], int(np.prod(shape))
        place = ctypes.c_void_p.from_address(at).value
        array = np.ctypeslib.as_array((kind * count).from_address(place)) if count else np.empty(0, dtype=kind)
        self.__dict__[name] = array.reshape(shape)
        return self.__dict__[name]

    def option(self, field: str) -> int:
        """An integer option, such as disableflags."""
        at = self.address + offset("mjModel", "opt") + offset("mjOption", field)
        return ctypes.c_int.from_address(at).value

    @property
    def signature(self) -> int:
        """What tells a model from others, also where it comes from a pickle or a binary file: its sizes and names."""
        names = ctypes.string_at(ctypes.c_void_p.from_address(self.address + offset("mjModel", "names")).value or 0,
                                 self.nnames)  # fmt: skip
        sizes = [self.nq, self.nv, self.nbody, self.ngeom, self.npluginstate]
        return int.from_bytes(hashlib.sha256(repr(sizes).encode() + names).digest()[:8], "little")


_MODEL = {field.name: field for field in structs.STRUCTS["mjModel"].fields}


def library() -> ctypes.CDLL:
    """The wheel's libmujoco."""
    folder = Path(mujoco.__file__).parent
    for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
        for path in sorted(folder.glob(pattern)):
            return ctypes.CDLL(str(path))
    raise ImportError(f"contactlaw finds no MuJoCo library in {folder}")


def check() -> None:
    """Compare the offsets with a live model; refuse a MuJoCo whose layout differs."""
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><option timestep='0.00123' integrator='implicit'/><worldbody><body><freejoint/><geom size='.1'/>"
        "<site name='s'/></body></worldbody><sensor><touch site='s'/></sensor></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)

    def at(kind: Any, base: int, place: int) -> Any:
        return kind.from_address(base + place).value

    def misplaced(live: Any, struct: str, places: dict[str, int]) -> list[str]:
        arrays = {
            field: getattr(live, field) for field in places if field not in ("plugin_state", "plugin_data", "time")
        }
        return [
            f"{struct}.{field}" for field, array in arrays.items()
            if array.size and at(ctypes.c_size_t, live._address, places[field]) != array.ctypes.data
        ]  # fmt: skip

    wrong = misplaced(data, "mjData", DATA) + misplaced(model, "mjModel", MODEL)
    numbers = {"timestep": (ctypes.c_double, TIMESTEP), "integrator": (ctypes.c_int, INTEGRATOR)}
    numbers["disableflags"] = ctypes.c_int, DISABLED
    wrong += [name for name, own in numbers.items() if at(own[0], model._address, own[1]) != getattr(model.opt, name)]
    if ModelView(model._address).nv != model.nv or at(ctypes.c_double, model._address, GRAVITY + 16) != -9.81:
        wrong.append("the sizes or options of mjModel")
    if wrong:
        raise ImportError(
            f"contactlaw does not fit MuJoCo {mujoco.__version__}: {', '.join(wrong)} not where its description says"
        )
