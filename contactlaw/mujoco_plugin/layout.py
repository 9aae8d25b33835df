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
from numpy.typing import NDArray

from contactlaw.jit import jit_for
from contactlaw.memory import element

_NUMBERS = {
    "int": "i4", "unsigned int": "u4", "float": "f4", "double": "f8", "char": "i1", "mjtNum": "f8", "mjtByte": "u1",
    "mjtBool": "u1", "mjtSize": "i8", "uint64_t": "u8", "int64_t": "i8", "size_t": "u8", "uintptr_t": "u8",
}  # fmt: skip


def _kind(node: Any) -> Any:
    if isinstance(node, ast_nodes.PointerType):
        return "u8"
    if isinstance(node, ast_nodes.ArrayType):
        return _kind(node.inner_type), tuple(node.extents)
    if isinstance(node, ast_nodes.AnonymousStructDecl):
        return _laid_out(node.fields)
    if isinstance(node, ast_nodes.ValueType):
        if node.name in _NUMBERS:
            return _NUMBERS[node.name]
        if node.name in structs.STRUCTS:
            return structure(node.name)
        if node.name.startswith("mjt"):  # the remaining types of this prefix are enums
            return "i4"
    raise ImportError(f"contactlaw does not know the type {node} in the structs of MuJoCo {mujoco.__version__}")


def _laid_out(fields: Any) -> np.dtype:
    return np.dtype([(field.name, _kind(field.type)) for field in fields], align=True)


@cache
def structure(name: str) -> np.dtype:
    """A MuJoCo struct as C lays it out."""
    return _laid_out(structs.STRUCTS[name].fields)


DATA = structure("mjData")[[
    "plugin_state", "plugin_data", "time", "qpos", "qvel", "qfrc_passive", "qfrc_applied", "qfrc_actuator",
    "qfrc_constraint", "qfrc_smooth", "qfrc_bias", "qDeriv", "xfrc_applied", "xpos", "xquat", "qacc", "sensordata",
    "geom_xpos", "geom_xmat", "xipos", "site_xpos", "site_xmat", "efc_id", "efc_type", "efc_pos", "efc_margin",
    "efc_KBIP", "efc_D", "efc_force", "ne", "nf", "nl", "nefc", "nJ", "efc_J", "efc_J_rownnz", "efc_J_rowadr",
    "efc_J_colind",
]]  # fmt: skip
"""Of a struct what compiled code knows."""
MODEL = structure("mjModel")[[
    "opt", "geom_bodyid", "D_rowadr", "D_diag", "jnt_type", "jnt_dofadr", "jnt_qposadr", "jnt_range", "site_type",
    "site_size",
]]  # fmt: skip
data_at: Any = element(DATA)
model_at: Any = element(MODEL)
JOINT_LIMIT = int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
NO_GRAVITY = int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
NO_CONTACT = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
NO_PASSIVE = int(mujoco.mjtDisableBit.mjDSBL_SPRING) | int(mujoco.mjtDisableBit.mjDSBL_DAMPER)
"""Where both are set passive forces, and with them the plugin's, are not computed."""
RUNGE_KUTTA = int(mujoco.mjtIntegrator.mjINT_RK4)
IMPLICITFAST = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
LOSES_SPIN = (3, 7) <= tuple(int(part) for part in mujoco.__version__.split(".")[:2]) <= (3, 10)
"""These let `implicitfast` undo what a plugin writes to the angular velocity of free bodies."""
SLEEP = int(getattr(mujoco.mjtEnableBit, "mjENBL_SLEEP", 0))  # from 3.5
SENSOR = int(mujoco.mjtPluginCapabilityBit.mjPLUGIN_SENSOR)
KEY = repr((mujoco.__version__, DATA, MODEL))
"""What compiled code that knows the offsets depends on."""

jit = jit_for(KEY)


class ModelView:
    """A compiled model at an address, as the callbacks get it: sizes as whole numbers, arrays as views, by name."""

    def __init__(self, address: int) -> None:
        self.address = address
        self._struct = record_at(address, structure("mjModel"), 1)[0]

    def __getattr__(self, name: str) -> Any:
        if name not in _MODEL:
            raise AttributeError(name)
        own, place = _MODEL[name], int(self._struct[name])
        if not own.array_extent:
            return place
        shape = [extent if isinstance(extent, int) else getattr(self, extent) for extent in own.array_extent]
        array = record_at(place, _kind(own.type.inner_type), np.prod(shape))
        self.__dict__[name] = array.reshape(shape)
        return self.__dict__[name]

    def name(self, kind: str, number: int) -> str:
        """Of a "geom", "body" or "plugin" instance; empty: it has none."""
        return (LIBRARY.mj_id2name(self.address, _type_of(kind), number) or b"").decode()

    def label(self, kind: str, number: int) -> str:
        """For messages: its name, or else its number."""
        return repr(self.name(kind, number) or number)

    def geom(self, name: str) -> int:
        """The id of a geom; -1: there is none of this name."""
        return LIBRARY.mj_name2id(self.address, _type_of("geom"), name.encode())

    def option(self, field: str) -> int:
        """An integer option, such as disableflags."""
        return int(self._struct["opt"][field])

    @property
    def signature(self) -> int:
        """What tells a model from others, also where it comes from a pickle or a binary file: its sizes and names."""
        sizes = [self.nq, self.nv, self.nbody, self.ngeom, self.npluginstate]
        return number_of(repr(sizes).encode() + self.names.tobytes())


def _type_of(kind: str) -> int:
    """MuJoCo's number for "geom" and the like. Its Python binding would end the error handling of who called `init`."""
    return LIBRARY.mju_str2Type(kind.encode())


def number_of(what: bytes) -> int:
    """A number that tells one text from others, of eight bytes."""
    return int.from_bytes(hashlib.sha256(what).digest()[:8], "little")


def record_at(address: Any, kind: Any, count: Any) -> NDArray[Any]:
    """So many records or numbers of a kind at an address, a view."""
    size = np.dtype(kind).itemsize * int(count)
    whole: Any = (ctypes.c_uint8 * size).from_address(int(address)) if size else b""
    return np.frombuffer(whole, kind)


_MODEL = {field.name: field for field in structs.STRUCTS["mjModel"].fields}


def _library() -> ctypes.CDLL:
    """The wheel's libmujoco, with what is called of it from Python."""
    folder = Path(mujoco.__file__).parent
    for pattern in ("libmujoco.so*", "libmujoco*.dylib", "mujoco.dll"):
        for path in sorted(folder.glob(pattern)):
            library, model, text, number = ctypes.CDLL(str(path)), ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int
            for name, result, *arguments in (
                ("mj_getPluginConfig", text, model, number, text), ("mj_id2name", text, model, number, number),
                ("mj_name2id", number, model, number, text), ("mju_str2Type", number, text),
                ("mjp_getPlugin", ctypes.c_void_p, text, ctypes.POINTER(number)),
            ):  # fmt: skip
                function = getattr(library, name)
                function.restype, function.argtypes = result, arguments
            return library
    raise ImportError(f"contactlaw finds no MuJoCo library in {folder}")


LIBRARY = _library()


def plugin_of(name: str) -> tuple[int | None, int]:
    """Address of a plugin's struct in MuJoCo's table, None: there is none, and its number there."""
    slot = ctypes.c_int(-1)
    return LIBRARY.mjp_getPlugin(name.encode(), ctypes.byref(slot)), slot.value


def check() -> None:
    """Compare the offsets with a live model; refuse a MuJoCo whose layout differs."""
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><option timestep='0.00123' integrator='implicit'/><worldbody><body><freejoint/><geom size='.1'/>"
        "<site name='s'/></body></worldbody><sensor><touch site='s'/></sensor></mujoco>"
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)

    wrong = []
    for live, name, struct in ((data, "mjData", DATA), (model, "mjModel", structure("mjModel"))):
        own = record_at(live._address, struct, 1)[0]
        for field in struct.names or ():
            array = getattr(live, field, None)
            if isinstance(array, np.ndarray) and array.size and own[field] != array.ctypes.data:
                wrong.append(f"{name}.{field}")
    own, opt = record_at(model._address, MODEL, 1)[0]["opt"], model.opt
    if (own["timestep"], own["integrator"], own["disableflags"]) != (opt.timestep, opt.integrator, opt.disableflags):
        wrong.append("mjModel.opt")
    if ModelView(model._address).nv != model.nv or own["gravity"][2] != -9.81:
        wrong.append("the sizes or options of mjModel")
    if wrong:
        raise ImportError(
            f"contactlaw does not fit MuJoCo {mujoco.__version__}: {', '.join(wrong)} not where its description says"
        )
