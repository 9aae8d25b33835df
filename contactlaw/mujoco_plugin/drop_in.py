"""The law in an existing model: an MJCF file in, a model or a new file out.

    import gymnasium
    from contactlaw import MATERIALS, ContactPair
    from contactlaw.mujoco_plugin import save_model

    hard = ContactPair(MATERIALS["steel"], MATERIALS["steel"], friction=0.2, restitution=0.8, radius=0.03)
    theirs = gymnasium.make("Pusher-v5").unwrapped.fullpath
    ours = save_model(theirs, "pusher.xml", [("body:object", "body:r_wrist_roll_link", hard)])
    env = gymnasium.make("Pusher-v5", xml_file=str(ours))

The new file names the plugin: a process that loads it must have imported `contactlaw.mujoco_plugin` before. Other
packages: docs/models.md.
"""

import os
import sys
import warnings
from collections.abc import Mapping, Sequence
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from contactlaw import checks
from contactlaw.files import whole
from contactlaw.mujoco_plugin import layout
from contactlaw.mujoco_plugin.constraints import skip_constraints
from contactlaw.mujoco_plugin.entries import Contacts, parse_contacts, parse_skip, replace_all
from contactlaw.mujoco_plugin.instances import contact_instances
from contactlaw.mujoco_plugin.overlaps import exclude_held, report_initial_overlaps
from contactlaw.mujoco_plugin.selection import give_names, label
from contactlaw.mujoco_plugin.spec import replace_native_contacts
from contactlaw.pair import ContactWarning
from contactlaw.world.near.sets import groups

Source = str | bytes | os.PathLike[str]
NEEDS = "<!-- before this is read: import contactlaw.mujoco_plugin -->"
OVERLAPS = ("relax", "keep", "raise")


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
            friction, restitution: For a table: a number, or a function of two materials. The default friction is that
                of the geoms, by the engine's rule; the default restitution is 1.
            overlaps: "relax": geoms that overlap by more than a tenth of their radius, or by more than an impact at 5
                m/s would compress them, initially or later, count as just touching there; those of the initial position
                are named in a warning, and the two bodies of a weld or connect constraint among them do not touch.
                "raise": an error instead. "keep": they are pressed together, without a warning; such bodies of a weld
                or connect are an error.

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
    choice = hasattr(spec.compiler, "savecompiled")  # from 3.16 on
    for exact in (True, False) if choice else (True,):  # models with <replicate> can be saved only when compiled
        if choice:
            spec.compiler.savecompiled = spec.compiler.savecanonical = not exact
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ContactWarning)  # already given when it was compiled
            text = spec.to_xml() if choice else _precise_xml(spec)
            try:
                again = mujoco.MjModel.from_xml_string(text, None if assets is None else dict(assets))
            except ValueError as error:
                trouble = str(error)
                continue
        if _equivalent(compiled, again, 1e-12 if exact else 1e-4):
            return text
        trouble = "what is read back is another model"
    raise ValueError(f"model: MuJoCo cannot write it as XML and read it again ({trouble}); use load_model")


def save_model(
    model: Source, target: str | os.PathLike[str], contacts: Contacts, *, assets: Mapping[str, bytes] | None = None,
    **settings: Any,
) -> Path:  # fmt: skip
    """Write the model with the law in it to a new file, for programs that load their model from a file.

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
    if not path.parent.is_dir():
        raise ValueError(f"target = {str(path)!r}: must be in a folder that exists")
    if path.exists() and not path.is_file():
        raise ValueError(f"target = {str(path)!r}: exists; must be a file")
    if path.exists() and path.stat().st_size > 0 and NEEDS not in path.read_text(encoding="utf-8", errors="replace"):
        raise ValueError(
            f"target = {str(path)!r}: exists, and save_model did not write it; must be another file than the model's "
            "own and what it refers to"
        )
    text = model_xml(model, contacts, assets=assets, **settings).replace("<extension>", f"{NEEDS}\n  <extension>", 1)
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")
    return path


def instances_of(model: mujoco.MjModel) -> list[str]:
    """Return the names of the contacts in a compiled model, for `contacts_of` and `ledger_of`."""
    view = layout.view_of(model)
    return [view.name("plugin", number) for number in contact_instances(view)]


def _compile_with_contacts(
    model: Source, contacts: Contacts, assets: Mapping[str, bytes] | None, *, friction: Any = None,
    restitution: Any = None, overlaps: Any = "relax", skip: Any = (), **settings: Any,
) -> tuple[mujoco.MjSpec, mujoco.MjModel]:  # fmt: skip
    """Return the specification with the law in it, and the compiled model; see `load_model`."""
    spec = _spec_of(model, assets)
    plain = spec.compile()
    if plain.opt.enableflags & layout.SLEEP:  # `init` does not see it, as compiling turns it off
        raise ValueError('model: <flag sleep="enable"/> must be off; a body that is struck by the law would not wake')
    if not isinstance(contacts, Mapping):
        for name, own in (("friction", friction), ("restitution", restitution)):
            if own is not None:
                raise ValueError(f"{name} = {own!r}: is of a table of materials; contacts of a list have their pair's")
    settings["overlaps"] = "keep" if checks.one_of("overlaps", overlaps, OVERLAPS) == "keep" else "relax"
    left = parse_skip(spec, skip)
    every = parse_contacts(spec, contacts, settings, friction, 1.0 if restitution is None else restitution)
    some = [entry for entry in every if not entry.as_native]
    for entry in some:
        if not entry.others and spec.compiler.discardvisual:
            raise ValueError(
                "others = False: must be True in a model whose compiler discards visual geoms (discardvisual; a URDF "
                "always does), as these geoms would become such"
            )
        _check_parent_child(plain, f"contacts[{entry.number}]", entry.ones, entry.twos)
    give_names(spec, [geom for entry in every for geom in (*entry.ones, *entry.twos)])
    if len(some) < len(every):
        replace_all(spec, plain, [*(entry for entry in every if entry.as_native), *left])
    for one in some:
        try:
            replace_native_contacts(spec, one)
        except ValueError as error:
            raise ValueError(f"contacts[{one.number}]: {error}") from None
    compiled = _compiled(spec)
    if overlaps != "raise" and exclude_held(spec, compiled, overlaps == "keep"):
        compiled = _compiled(spec)
    if instances_of(compiled) == instances_of(plain):
        text = "contacts: no two geoms that touch natively are in one of them; nothing is added"
        warnings.warn(text, ContactWarning, stacklevel=3)
    if overlaps != "keep":
        report_initial_overlaps(compiled, overlaps == "raise")
    return spec, compiled


def _precise_xml(spec: mujoco.MjSpec) -> str:
    """Return a specification as XML with all digits; MuJoCo up to 3.15 writes six, and no `inertiagrouprange`."""
    before = layout.LIBRARY._mjPRIVATE__get_xml_precision()
    layout.LIBRARY._mjPRIVATE__set_xml_precision(17)
    try:
        text = spec.to_xml()
    finally:
        layout.LIBRARY._mjPRIVATE__set_xml_precision(before)
    first, last = spec.compiler.inertiagrouprange  # of the geoms that have mass: robosuite and metaworld use it
    return (
        text
        if "inertiagrouprange=" in text
        else text.replace("<compiler ", f'<compiler inertiagrouprange="{first} {last}" ', 1)
    )


def _compiled(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a specification; an error of the plugin, which it can only print, becomes the ValueError."""
    printed = StringIO()
    try:
        with redirect_stderr(printed):
            model = spec.compile()
    except ValueError as error:
        said = [line for line in printed.getvalue().splitlines() if line.startswith("contactlaw: ")]
        reasons = [line for line in said if not line.startswith("contactlaw: compiling")]
        if not reasons:
            raise
        raise ValueError("; ".join(dict.fromkeys(reasons)).replace("contactlaw: ", "")) from error
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
    files = dict(assets or {})
    parts = {name: text for name, text in files.items() if name.endswith(".xml")}
    others = {name: data for name, data in files.items() if name not in parts}
    if isinstance(model, str) and model.lstrip("\ufeff \t\r\n").startswith("<"):
        return mujoco.MjSpec.from_string(os.fspath(model), include=parts or None, assets=others or None)
    path = Path(model).absolute()
    if not path.is_file():
        raise ValueError(f"model = {os.fspath(model)!r}: no such file")
    spec = mujoco.MjSpec.from_file(str(path), include=parts or None, assets=others or None)
    for folder in ("meshdir", "texturedir"):
        setattr(spec.compiler, folder, str(path.parent / getattr(spec.compiler, folder)))
    return spec


def _check_parent_child(model: mujoco.MjModel, which: str, ones: Sequence[Any], twos: Sequence[Any]) -> None:
    """Refuse sets that hold parent and child: they usually overlap at their joint, and the engine lets them."""
    if len(ones) == len(twos) == 1:
        return
    weld, parent = model.body_weldid, model.body_parentid
    carried = [groups(geoms, lambda geom: int(weld[model.geom_bodyid[geom.id]])) for geoms in (ones, twos)]
    for order in (1, -1):
        here, there = carried[::order]
        for body, geoms in here.items():
            above = int(weld[parent[body]])
            if body and above and above in there:
                one, two = (geoms[0], there[above][0])[::order]
                raise ValueError(
                    f"{which}: {label(one)} and {label(two)} belong to parent and child, which "
                    "overlap at their joint; leave one of them out, or let just these two touch in a contact of "
                    "their own"
                )


def _equivalent(one: mujoco.MjModel, two: mujoco.MjModel, tolerance: float) -> bool:
    """Return whether two models move alike: same sizes, and numbers equal to a part of the greatest in each field."""
    for field in ("body_mass", "body_inertia", "body_pos", "body_quat", "geom_size", "geom_pos", "geom_quat",
                  "geom_contype", "geom_conaffinity", "jnt_range", "dof_damping", "dof_armature", "qpos0",
                  "pair_geom1", "pair_geom2", "actuator_gainprm", "plugin_stateadr"):  # fmt: skip
        a, b = np.asarray(getattr(one, field)), np.asarray(getattr(two, field))
        if a.shape != b.shape or (a.size and np.abs(a - b).max() > tolerance * np.abs(a).max()):
            return False
    return one.opt.timestep == two.opt.timestep and one.opt.integrator == two.opt.integrator
