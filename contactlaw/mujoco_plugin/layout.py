"""Memory layout of MuJoCo's structs: offsets from the wheel's own description, checked against a live model."""

import ctypes
import hashlib
from collections.abc import Iterator
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco.introspect import ast_nodes, structs

from contactlaw import checks
from contactlaw.memory import element, record_at

_NUMBERS = {
    "int": "i4", "unsigned int": "u4", "float": "f4", "double": "f8", "char": "i1", "mjtNum": "f8", "mjtByte": "u1",
    "mjtBool": "u1", "mjtSize": "i8", "uint64_t": "u8", "int64_t": "i8", "size_t": "u8", "uintptr_t": "u8",
}  # fmt: skip


def _dtype_of(node: Any) -> Any:
    if isinstance(node, ast_nodes.PointerType):
        return "u8"
    if isinstance(node, ast_nodes.ArrayType):
        return _dtype_of(node.inner_type), tuple(node.extents)
    if isinstance(node, ast_nodes.AnonymousStructDecl):
        return _struct_dtype(node.fields)
    if isinstance(node, ast_nodes.ValueType) and node.name in structs.STRUCTS:
        return structure(node.name)
    if isinstance(node, ast_nodes.ValueType) and (node.name in _NUMBERS or node.name.startswith("mjt")):
        return _NUMBERS.get(node.name, "i4")  # the remaining types of this prefix are enums
    raise ImportError(f"contactlaw does not know the type {node} in the structs of MuJoCo {mujoco.__version__}")


def _struct_dtype(fields: Any) -> np.dtype:
    return np.dtype([(field.name, _dtype_of(field.type)) for field in fields], align=True)


@cache
def structure(name: str) -> np.dtype:
    """Return the dtype of a MuJoCo struct as C lays it out."""
    return _struct_dtype(structs.STRUCTS[name].fields)


TENDON_ROWS = sorted({"ten_J_rownnz", "ten_J_rowadr", "ten_J_colind"} & {*(structure("mjModel").names or ())})
"""The places of the entries of tendons' Jacobians, if the model has them; in older versions they may be dense."""

DATA = structure("mjData")[[
    "plugin_state", "plugin_data", "time", "qpos", "qvel", "qfrc_passive", "qfrc_spring", "qfrc_applied",
    "qfrc_actuator", "qfrc_constraint", "qfrc_smooth", "qfrc_bias", "qDeriv", "xfrc_applied", "xpos", "xquat", "qacc",
    "sensordata",
    "geom_xpos", "geom_xmat", "xipos", "site_xpos", "site_xmat", "efc_pos", "efc_margin",
    "efc_KBIP", "efc_D", "efc_force", "ne", "nf", "nl", "efc_J", "efc_J_rownnz", "efc_J_rowadr", "efc_J_colind",
    "actuator_force", "actuator_moment", "moment_rownnz", "moment_rowadr", "moment_colind",
    "actuator_velocity", "efc_frictionloss", "ten_length", "ten_J",
]]  # fmt: skip
"""The fields of mjData that compiled code uses; `MODEL`: those of mjModel."""
MODEL = structure("mjModel")[[
    "ntendon", "opt", "geom_bodyid", "D_rowadr", "D_diag", "jnt_type", "jnt_dofadr", "jnt_qposadr", "jnt_range",
    "jnt_limited", "jnt_margin", "jnt_solref", "jnt_solimp", "jnt_stiffness", "dof_jntid", "dof_invweight0",
    "site_type", "site_size", "actuator_biasprm", "actuator_forcerange", "actuator_trntype", "actuator_trnid",
    "jnt_actfrcrange", "tendon_actfrcrange", "tendon_stiffness", "tendon_lengthspring", "tendon_limited",
    "tendon_range", "tendon_margin", "tendon_solref_lim", "tendon_solimp_lim", "tendon_invweight0",
    "actuator_forcelimited", "jnt_actfrclimited", "tendon_actfrclimited", "actuator_group", *TENDON_ROWS,
]]  # fmt: skip
data_at: Any = element(DATA)
model_at: Any = element(MODEL)
REF, IMP = int(mujoco.mjNREF), int(mujoco.mjNIMP)
LEAST_IMPEDANCE, MOST_IMPEDANCE, MINVAL = mujoco.mjMINIMP, mujoco.mjMAXIMP, mujoco.mjMINVAL
BIAS = int(mujoco.mjNBIAS)  # parameters of an actuator's bias
NO_GRAVITY = int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
NO_CONTACT = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
NO_LIMIT = int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
NO_ACTUATION = int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
LAST_GROUP = 30  # of actuators that `mjOption.disableactuator` may switch off
REF_UNSAFE = int(mujoco.mjtDisableBit.mjDSBL_REFSAFE)
NO_SPRING = int(mujoco.mjtDisableBit.mjDSBL_SPRING)
NO_PASSIVE = NO_SPRING | int(mujoco.mjtDisableBit.mjDSBL_DAMPER)
"""With both flags set, MuJoCo computes no passive forces and does not call the plugin's compute."""
SPARSE, AUTO, SPARSE_FROM = int(mujoco.mjtJacobian.mjJAC_SPARSE), int(mujoco.mjtJacobian.mjJAC_AUTO), 60
"""Kinds of Jacobian; with the latter, constraints have a sparse one from so many velocities on (`mj_isSparse`)."""
TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)
DISCRETE = int(getattr(mujoco.mjtIntegrator, "mjINT_DISCRETE", -1))  # from 3.13
IMPLICITFAST = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
LOSES_SPIN = (3, 7) <= tuple(int(part) for part in mujoco.__version__.split(".")[:2]) <= (3, 10)
"""In these versions `implicitfast` overwrites what a plugin writes to the angular velocity of free bodies."""
SLEEP = int(getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0))  # from 3.5
OVERRIDE = int(mujoco.mjtEnableBit.mjENBL_OVERRIDE)
SENSOR = int(mujoco.mjtPluginCapabilityBit.mjPLUGIN_SENSOR)
KEY = repr((mujoco.__version__, DATA, MODEL))
"""Part of the cache key of compiled code that depends on the offsets, which Python reaches by `address_of` alone."""


class ModelView:
    """A compiled model at an address, as callbacks get it: fields by name, numbers as int and arrays as views."""

    def __init__(self, address: int) -> None:
        self.address = address
        self._struct = record_at(address, structure("mjModel"), 1)[0]

    def __getattr__(self, name: str) -> Any:
        if name not in _MODEL:
            raise AttributeError(name)
        own, place = _MODEL[name], self._struct[name]
        if not own.array_extent:
            return place if place.dtype.names else int(place)
        shape = [extent if isinstance(extent, int) else getattr(self, extent) for extent in own.array_extent]
        array = record_at(place, _dtype_of(own.type.inner_type), np.prod(shape)).reshape(shape)
        return self.__dict__.setdefault(name, array)

    def name(self, kind: str, number: int) -> str:
        """Return the name of a "geom", "body", "plugin" ..., empty if it has none."""
        return ctypes.string_at(self.names.ctypes.data + int(getattr(self, f"name_{kind}adr")[number])).decode()

    def label(self, kind: str, number: int) -> str:
        """Return the quoted name, or the number if there is none, for messages."""
        return repr(self.name(kind, number) or number)

    def geom(self, name: str) -> int:
        """Return the id of a geom; -1 if there is none of this name."""
        return LIBRARY.mj_name2id(self.address, int(mujoco.mjtObj.mjOBJ_GEOM), name.encode())

    def chain(self, body: int) -> Iterator[int]:
        """Yield a body and those that carry it, without the world's."""
        while body:
            yield body
            body = int(self.body_parentid[body])

    @cached_property
    def bits(self) -> list[tuple[int, int]]:
        """contype and conaffinity of each geom."""
        return list(zip(self.geom_contype.tolist(), self.geom_conaffinity.tolist(), strict=True))

    @cached_property
    def margins(self) -> dict[tuple[int, int], float]:
        """Margin [m] of each two geoms, in ascending order, that a `<pair>` names; of several the greatest."""
        pairs = np.sort([self.pair_geom1, self.pair_geom2], axis=0).T.tolist()
        return dict(sorted(zip(map(tuple, pairs), self.pair_margin.tolist(), strict=True)))

    @cached_property
    def carriers(self) -> Any:
        """Of each body: the one that carries it and what is welded to it."""
        return self.body_weldid[self.body_parentid[self.body_weldid]]

    @property
    def signature(self) -> int:
        """Hash of sizes and names, the same for a model that comes from a pickle or a binary file."""
        sizes = [self.nq, self.nv, self.nbody, self.ngeom, self.npluginstate]
        return hash_of(repr(sizes).encode() + self.names.tobytes())


def hash_of(what: bytes) -> int:
    """Return a hash of bytes as an integer of eight bytes."""
    return int.from_bytes(hashlib.sha256(what).digest()[:8], "little")


_MODEL = {field.name: field for field in structs.STRUCTS["mjModel"].fields}


def _library() -> ctypes.CDLL:
    """Return the wheel's libmujoco, with the argument types of the functions called from Python."""
    folder = Path(mujoco.__file__).parent
    paths = [path for name in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll") for path in sorted(folder.glob(name))]
    if not paths:
        raise ImportError(f"contactlaw finds no MuJoCo library in {folder}")
    library, address, text, number = ctypes.CDLL(str(paths[0])), ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int
    library.mj_getPluginConfig.argtypes, library.mj_getPluginConfig.restype = [address, number, text], text
    library.mj_name2id.argtypes = [address, number, text]
    library.mjp_getPlugin.argtypes, library.mjp_getPlugin.restype = [text, ctypes.POINTER(number)], address
    return library


LIBRARY = _library()


def plugin_of(name: str) -> tuple[int | None, int]:
    """Return the address of a plugin's struct in MuJoCo's table, None if it is not registered, and its slot."""
    slot = ctypes.c_int(-1)
    return LIBRARY.mjp_getPlugin(name.encode(), ctypes.byref(slot)), slot.value


def view_of(model: mujoco.MjModel, *states: mujoco.MjData) -> ModelView:
    """Return the view of a model; a ValueError if it is none, or if states do not belong to it."""
    checks.instance("model", model, mujoco.MjModel)
    for data in states:
        checks.instance("data", data, mujoco.MjData)
        if data.signature != model.signature or data.plugin_data.size != model.nplugin:
            raise ValueError("data: is of another model")
    return ModelView(model._address)


def check() -> None:
    """Compare the offsets with a live model; an ImportError tells what differs."""
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><option timestep='0.00123' integrator='implicit'/><worldbody><body><freejoint/><geom size='.1'/>"
        "<site name='s'/></body></worldbody><sensor><touch site='s'/></sensor></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)

    wrong, whole = [], record_at(model._address, structure("mjModel"), 1)[0]
    both = (data, "mjData", record_at(data._address, DATA, 1)[0]), (model, "mjModel", whole)
    for live, name, own in (*both, (model.opt, "mjModel.opt", whole["opt"])):
        for field in own.dtype.names:
            value, place = getattr(live, field, None), own[field]
            if isinstance(value, np.ndarray) and place.ndim == 0:  # the struct has its address
                value = value.ctypes.data if value.size else None
            if isinstance(value, int | float | np.ndarray) and not np.array_equal(place, value):
                wrong.append(f"{name}.{field}")
    if wrong:
        where = f"{', '.join(wrong)} not where its description says"
        raise ImportError(f"contactlaw does not fit MuJoCo {mujoco.__version__}: {where}")
