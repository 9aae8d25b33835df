"""The law in an existing model: an MJCF file in, a model or a new file out. Other packages: docs/models.md."""

import os
import re
import sys
import warnings
from collections.abc import Mapping, Sequence
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np

from contactlaw import checks
from contactlaw.files import whole
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.config import KEYS, OVERLAPS, PLUGIN_NAME
from contactlaw.mujoco_plugin.geoms import first_of, give_names, shape_of
from contactlaw.mujoco_plugin.instances import NO_CONSTRAINT, skip_constraints
from contactlaw.mujoco_plugin.notices import reported_of
from contactlaw.mujoco_plugin.readout import instances_of, overlaps_of, view_of
from contactlaw.mujoco_plugin.spec import Contacts, parse_contacts, parse_skip, replace_all, replace_native_contacts
from contactlaw.pair import ContactWarning
from contactlaw.world.near.sets import groups
from contactlaw.world.readout import PUT_IN

Source = str | bytes | os.PathLike[str]
NEEDS = "<!-- before this is read: import contactlaw.mujoco_plugin -->"
NAMED = 5  # overlapping pairs in a message
INSIDE = 0.1  # depth over the radius of the smaller bounding sphere: deeper than any contact


def load_model(
    model: Source, contacts: Contacts, *, assets: Mapping[str, bytes] | None = None, **settings: Any
) -> mujoco.MjModel:
    """Read a model, let geoms of it touch by the law, and compile it.

    Args:
        model: Path of an MJCF or URDF file (included files are found beside it), or MJCF as text.
        contacts: Each (geoms1, geoms2, pair), as for `add_contact`; geoms by name, pattern, body or id, see `geoms_of`.
            A fourth entry, a dict, holds settings for this contact alone.
            "*" alone stands for every geom, and only for contacts that the model would make natively: by contype and
            conaffinity, <exclude> and <pair> (whose friction and solver numbers are ignored), and not between parent
            and child. What the law cannot serve keeps the engine's own contact, with a warning. If several entries fit
            two geoms, the one with fewer "*" has them, then the later one.
            Or a table {geoms: Material or its name} for every native contact; the last entry that fits a geom holds.
        assets: Included files and assets by name, for a model given as text.
        settings: Those of `add_contact`, for all contacts: others, substeps, crowd_substeps, rounding. Also
            skip: Geoms, or pairs (geoms1, geoms2), that keep the engine's own contact whatever "*" says.
            friction, restitution: For a table: a number or curve, or a function of two materials. The default friction
                is that of the geoms, by the engine's rule; the default restitution is 1.
            overlaps: "relax": geoms that overlap deeply, initially or later, count as just touching there; those of the
                initial position are named in a warning, and the two bodies of a weld or connect constraint among them
                do not touch. "raise": an error instead. "keep": they are pressed together, without a warning; such
                bodies of a weld or connect are an error. How deep: docs/models.md.

    Raises:
        ValueError: The model cannot be read, or the law cannot serve a contact; the message names the geom.
    """
    compiled = _compile_with_contacts(model, contacts, assets, **settings)[1]
    skip_constraints(compiled)
    return compiled


def model_xml(model: Source, contacts: Contacts, *, assets: Mapping[str, bytes] | None = None, **settings: Any) -> str:
    """Return the model with the law in it as MJCF in one piece; arguments and errors as for `load_model`.

    Numbers keep all digits. Included files are merged; meshes, textures and height fields of a file are referred to by
    absolute paths, those of `assets` by their names.

    Raises:
        ValueError: As `load_model`; or MuJoCo cannot write this model so that reading it gives the same model.
    """
    spec, compiled = _compile_with_contacts(model, contacts, assets, **settings)
    text, trouble = _with_instances(spec, _precise_xml(spec)), "what is read back is another model"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ContactWarning)  # already given when it was compiled
        try:
            if _equivalent(compiled, mujoco.MjModel.from_xml_string(text, None if assets is None else dict(assets))):
                return text
        except ValueError as error:
            trouble = str(error)
    raise ValueError(f"model: MuJoCo cannot write it as XML and read it again ({trouble}); use load_model")


def save_model(
    model: Source, target: str | os.PathLike[str], contacts: Contacts, *, assets: Mapping[str, bytes] | None = None,
    **settings: Any,
) -> Path:  # fmt: skip
    """Write the model with the law to a new file, for programs that load it after importing `contactlaw.mujoco_plugin`.

    Args:
        target: Path of the file. An existing file must be empty or written by this function; it is replaced only when
            the new text is complete.
        model, contacts, assets, settings: As for `model_xml`, and so are errors.

    Returns:
        The absolute path of the target.

    Raises:
        ValueError: The target is not a file, or one that this function did not write, or its folder does not exist.
        OSError: The target cannot be written; an existing file is left as it is.
    """
    if not isinstance(target, str | os.PathLike) or not os.fspath(target) or "\0" in os.fspath(target):
        raise ValueError(f"target = {target!r}: must be the path of a file")
    path = Path(target).absolute()
    if path.suffix == ".mjb":
        raise ValueError(f"target = {target!r}: must be a file of XML; mujoco.mj_saveModel writes a compiled model")
    if not path.parent.is_dir():
        raise ValueError(f"target = {str(path)!r}: must be in a folder that exists")
    if path.exists() and not path.is_file():
        raise ValueError(f"target = {str(path)!r}: exists; must be a file")
    old = path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""
    if old and NEEDS not in old:
        raise ValueError(
            f"target = {str(path)!r}: exists, and save_model did not write it; must be another file than the model's "
            "own and what it refers to"
        )
    text = model_xml(model, contacts, assets=assets, **settings).replace("<extension>", f"{NEEDS}\n  <extension>", 1)
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")
    return path


def _compile_with_contacts(
    model: Source, contacts: Contacts, assets: Mapping[str, bytes] | None, *, friction: Any = None,
    restitution: Any = None, overlaps: Any = "relax", skip: Any = (), **settings: Any,
) -> tuple[mujoco.MjSpec, mujoco.MjModel]:  # fmt: skip
    """Return the specification with the law in it, and the compiled model; see `load_model`."""
    spec = _spec_of(model, assets)
    plain, before = spec.compile(), len(spec.plugins)
    settings["overlaps"] = "keep" if checks.one_of("overlaps", overlaps, (*OVERLAPS, "raise")) == "keep" else "relax"
    left = parse_skip(spec, skip)
    every = parse_contacts(spec, contacts, settings, friction, restitution)
    some = [entry for entry in every if not entry.as_native]
    for entry in some:
        if not entry.others and spec.compiler.discardvisual:
            raise ValueError(
                "others = False: must be True in a model whose compiler discards visual geoms (discardvisual; a URDF "
                "always does), as these geoms would become such"
            )
        _check_parent_child(plain, f"contacts[{entry.number}]", entry.ones, entry.twos)
    give_names(spec, [geom for entry in every for geom in (*entry.ones, *entry.twos)])
    if len(some) < len(every) and not plain.opt.disableflags & NO_CONSTRAINT:  # it disables native contacts too
        replace_all(spec, plain, [*(entry for entry in every if entry.as_native), *left])
    for one in some:
        try:
            replace_native_contacts(spec, one)
        except ValueError as error:
            raise ValueError(f"contacts[{one.number}]: {error}") from None
    if len(spec.plugins) == before:
        text = "contacts: no two geoms that touch natively are in one of them; nothing is added"
        warnings.warn(text, ContactWarning, stacklevel=3)
    return spec, _settle_overlaps(spec, _compiled(spec), overlaps)


def _precise_xml(spec: mujoco.MjSpec) -> str:
    """Return a specification as XML with all digits; MuJoCo up to 3.15 writes six, and leaves out the two below."""
    if hasattr(spec.compiler, "savecompiled"):  # from 3.16 on
        spec.compiler.savecompiled = spec.compiler.savecanonical = False
        return spec.to_xml()
    before = layout.LIBRARY._mjPRIVATE__get_xml_precision()
    layout.LIBRARY._mjPRIVATE__set_xml_precision(17)
    try:
        text = spec.to_xml()
    finally:
        layout.LIBRARY._mjPRIVATE__set_xml_precision(before)
    first, last = spec.compiler.inertiagrouprange  # of the geoms that have mass: robosuite and metaworld use it
    left_out = {"inertiagrouprange": f"{first} {last}"}
    if spec.compiler.settotalmass > 0.0:  # cheetahs use it
        left_out["settotalmass"] = repr(spec.compiler.settotalmass)
    added = "".join(f'{name}="{value}" ' for name, value in left_out.items() if f"{name}=" not in text)
    return text.replace("<compiler ", f"<compiler {added}", 1)


def _with_instances(spec: mujoco.MjSpec, text: str) -> str:
    """Return the XML of a specification with all contacts of the law.

    MuJoCo leaves out those that come after an instance without a name, as a sensor's, or after another plugin's.
    """
    plugin = ElementTree.Element("plugin", plugin=PLUGIN_NAME)
    for own in (own for own in spec.plugins if own.name and own.plugin_name == PLUGIN_NAME):
        instance = ElementTree.SubElement(plugin, "instance", name=own.name)
        for key in (key for key in KEYS if key in own.config):
            ElementTree.SubElement(instance, "config", key=key, value=own.config[key])
    ElementTree.indent(plugin, level=2)
    written = re.compile(f'<plugin plugin="{PLUGIN_NAME}"(/>|>.*?</plugin>)', re.DOTALL)
    return written.sub(lambda _: ElementTree.tostring(plugin, encoding="unicode"), text, count=1)


def _compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a specification; an error of the plugin, which it can only print, becomes the ValueError."""
    printed = StringIO()
    try:
        with redirect_stderr(printed), warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Attach conflict")  # given when the plain model was compiled
            model = spec.compile()
    except ValueError as error:
        said = re.findall("^contactlaw: (?!compiling)(.*)", printed.getvalue(), re.MULTILINE)
        if not said:
            raise
        raise ValueError("; ".join(dict.fromkeys(said))) from error
    sys.stderr.write(printed.getvalue())
    return model


def _spec_of(model: Source, assets: Mapping[str, bytes] | None) -> mujoco.MjSpec:
    """Read a file or text; the asset folders of a file are made absolute."""
    if isinstance(model, bytes):
        model = model.decode()
    if not isinstance(model, str | os.PathLike):
        other = "; for an MjSpec there is add_contact" if isinstance(model, mujoco.MjSpec) else ""
        raise ValueError(f"model = {model!r}: must be the path of an MJCF or URDF file, or MJCF as text{other}")
    if assets is not None and not (isinstance(assets, Mapping) and all(isinstance(name, str) for name in assets)):
        raise ValueError(f"assets = {assets!r}: must be a dictionary of files by name")
    parts = {name: text for name, text in (assets or {}).items() if name.endswith(".xml")} or None
    others = {name: data for name, data in (assets or {}).items() if not name.endswith(".xml")} or None
    if isinstance(model, str) and model.lstrip("\ufeff \t\r\n").startswith("<"):
        return mujoco.MjSpec.from_string(os.fspath(model), include=parts, assets=others)
    path = Path(model).absolute()
    if not path.is_file():
        raise ValueError(f"model = {os.fspath(model)!r}: no such file")
    spec = mujoco.MjSpec.from_file(str(path), include=parts, assets=others)
    for folder in ("meshdir", "texturedir"):
        setattr(spec, folder, str(path.parent / getattr(spec, folder)))  # of the compiler too, from 3.3.7 on
    return spec


def _check_parent_child(model: mujoco.MjModel, which: str, ones: Sequence[Any], twos: Sequence[Any]) -> None:
    """Refuse sets that hold parent and child: they usually overlap at their joint, and the engine lets them."""
    if len(ones) == len(twos) == 1:
        return
    weld, carriers = model.body_weldid, layout.view_of(model).carriers
    sides = [groups(geoms, lambda geom: int(weld[model.geom_bodyid[geom.id]])) for geoms in (ones, twos)]
    for here, there in (sides, sides[::-1]):
        for body, geoms in here.items():
            above = int(carriers[body])
            if above and above in there:
                carrier, carried = (shape_of(one).label for one in (there[above][0], geoms[0]))
                raise ValueError(
                    f"{which}: {carrier} and {carried} belong to parent and child, which overlap at their joint; leave "
                    "one of them out, or let just these two touch in a contact of their own"
                )


def _equivalent(one: mujoco.MjModel, two: mujoco.MjModel) -> bool:
    """Return whether two models move alike: same sizes, and numbers equal to rounding of the greatest in each field."""
    for field in ("body_mass", "body_inertia", "body_pos", "body_quat", "geom_aabb", "geom_pos", "geom_quat",
                  "geom_contype", "geom_conaffinity", "jnt_range", "dof_damping", "dof_armature", "qpos0",
                  "pair_geom1", "pair_geom2", "actuator_gainprm"):  # fmt: skip
        a, b = np.asarray(getattr(one, field)), np.asarray(getattr(two, field))
        if a.shape != b.shape or (a.size and np.abs(a - b).max() > 1e-12 * np.abs(a).max()):
            return False
    same = one.opt.timestep == two.opt.timestep and one.opt.integrator == two.opt.integrator
    return same and instances_of(one) == instances_of(two)


def _settle_overlaps(spec: mujoco.MjSpec, model: mujoco.MjModel, overlaps: str) -> mujoco.MjModel:
    """Tell, once, of geoms of the law that lie in each other too deep in the initial position; return the final model.

    Bodies of a connect or weld constraint that are built into each other do not touch: it holds them so, and there is
    no sensible normal along which they could push.
    """
    weld, both = model.body_weldid, np.array([model.eq_obj1id, model.eq_obj2id]).T
    on_sites, ties = model.eq_objtype == mujoco.mjtObj.mjOBJ_SITE, (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD)
    both[on_sites] = model.site_bodyid[both[on_sites]]
    tied = set(map(frozenset, weld[both[np.isin(model.eq_type, ties)]].tolist())) if overlaps != "raise" else set()
    held, found = dict[tuple[int, int], str](), dict[tuple[int, int], str]()  # by bodies; by geoms
    for geoms, text in (_deep_overlaps(model) if tied or overlaps != "keep" else {}).items():
        bodies = model.geom_bodyid[[*geoms]]
        if frozenset(weld[bodies].tolist()) in tied:
            held.setdefault(tuple(bodies.tolist()), text)
        elif overlaps != "keep":
            found[geoms] = text
    built = f"parts are built into each other: {first_of([*held.values()], NAMED, 'pairs')}"
    if held and overlaps == "keep":
        where = f"overlaps = 'keep': {built}"
        raise ValueError(f"{where}; a weld or connect holds them so, leave them out by an <exclude>")
    if held:
        every = {body.id: body for body in spec.bodies}
        for one, two in ((every[a], every[b]) for a, b in held):
            one.name, two.name = one.name or f"body{one.id}", two.name or f"body{two.id}"
            spec.add_exclude(bodyname1=one.name, bodyname2=two.name)
        warnings.warn(f"{built}; their bodies do not touch", ContactWarning, stacklevel=4)
        model = _compiled(spec)
    if found:
        text = f"geoms overlap in the initial position of the model: {first_of([*found.values()], NAMED, 'pairs')}"
        if overlaps == "raise":
            raise ValueError(f"overlaps = 'raise': {text}")
        warnings.warn(f"{text}; they count as just touching", ContactWarning, stacklevel=4)
        world = view_of(model, mujoco.MjData(model))
        group = dict(zip(world.geoms.tolist(), world.shapes["group"].tolist(), strict=True))
        told = reported_of(layout.view_of(model), world.pairs.size)
        for one, two in found:
            told[world.groups[group[one], group[two]]] |= PUT_IN
    return model


def _deep_overlaps(model: mujoco.MjModel) -> dict[tuple[int, int], str]:
    """Return geoms of the law that lie in each other too deep in the initial position, and the text for a message."""
    data, view = mujoco.MjData(model), layout.view_of(model)
    mujoco.mj_kinematics(model, data)
    return {
        (one, two): f"{view.label('geom', one)} and {view.label('geom', two)} by {1e3 * depth:.3g} mm"
        for one, two, depth in overlaps_of(model, data)
        if depth > INSIDE * min(reach for reach in model.geom_rbound[[one, two]] if reach > 0.0)
    }
