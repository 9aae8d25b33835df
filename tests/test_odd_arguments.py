"""Arrays for numbers, text, None, NaN, extremes: public functions give a result or an error that names the argument."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from contactlaw import (
    Body,
    ContactPair,
    Material,
    calibrate,
    collide,
    contact_velocities,
    force_along_path,
    losses,
    rebound,
)
from contactlaw.laws import KNOWN
from contactlaw.world import World
from contactlaw.world.trees.description import Joint, Part, Tree
from tests.odd_arguments import check_odd_arguments

PAIR = ContactPair("steel", "steel", 0.3, 0.9, 0.01)
CURVED = ContactPair("steel", "steel", losses.FallingFriction(0.2, 0.1, 1.0), losses.Viscoelastic(0.9, 1.0), 0.01)
OBLIQUE = np.linspace(0.2, 6.0, 8)
IMPACTS = {
    "before": (np.ones(8), OBLIQUE), "after": (np.full(8, 0.9), rebound(OBLIQUE, 1.4, restitution=0.9)),
    "inertia_ratio": 0.4, "normal_error": 0.01, "tangential_error": 0.01, "stiffness_ratio": 0.85,
    "hold_stiffness_ratio": False, "restitution": None, "restitution_law": None,
}  # fmt: skip
TREE = Tree([Part(1.0, 1.0, [Joint()])])

FUNCTIONS = {
    "Material": (Material, {"youngs_modulus": 1e9, "poissons_ratio": 0.3, "density": 1.0}),
    "from_shear_modulus": (
        Material.from_shear_modulus, {"shear_modulus": 1e9, "poissons_ratio": 0.3, "density": 1.0},
    ),
    "ContactPair": (ContactPair, {
        "a": "steel", "b": "steel", "friction": 0.1, "restitution": 0.9, "radius": 0.01, "law": "microslip",
        "stiffness_ratio": 1.0, "rolling_resistance": 0.0,
    }),
    "rebound": (rebound, {
        "psi_1": 1.0, "chi": 1.0, "law": "microslip", "restitution": 0.9, "steps": None,
    }),
    "rebound, arrays": (rebound, {"psi_1": [1.0, 2.0], "chi": 1.0, "law": "mindlin", "restitution": 0.9, "steps": 99}),
    "Body": (Body, {"mass": 1.0, "radius": 0.1, "inertia": 0.1, "velocity": (0, 0, -1.0), "spin": (0, 0, 0)}),
    "collide": (collide, {
        "pair": PAIR, "a": Body(1.0, 0.01, velocity=(1, 0, -1)), "b": None, "normal": (0, 0, 1.0), "steps": 200,
    }),
    "force_along_path": (force_along_path, {
        "pair": ContactPair("steel", "steel", 0.3, 1.0, 0.01), "approach": [0, 1e-5], "displacement": [0, 1e-5],
    }),
    "contact_velocities": (contact_velocities, {"normal": [1, 2.0], "tangential": [1, 2.0], "spin": 0, "radius": 0.1}),
    "Viscoelastic": (losses.Viscoelastic, {"restitution": 0.9, "speed": 1.0}),
    "Viscoelastic, time": (losses.Viscoelastic(0.9, 1.0).time, {"mass": 1.0, "stiffness": 1.0}),
    "Plastic": (losses.Plastic, {"yield_speed": 0.9, "below": 1.0}),
    "FallingFriction": (losses.FallingFriction, {"start": 0.2, "end": 0.1, "speed": 1.0}),
    "Table": (losses.Table, {"speeds": (1.0, 2.0), "measured": (0.5, 0.4)}),
    "World": (World, {
        "gravity": (0, 0, -9.81), "timestep": 1e-3, "substeps": 100.0, "crowd_substeps": 20.0, "crowd": 4,
        "stillness": 1e-9,
    }),
    "Tree of parts": (Tree, {"parts": TREE.parts}),
    "Tree": (
        lambda mass, inertia, parent, position, quaternion, **joint: Tree(
            [Part(mass, inertia, [Joint(**joint)], parent, position, quaternion)]
        ),
        {
            "kind": "hinge", "at": (0, 0, 0), "axis": (0, 1, 0), "armature": 0.0, "damping": 0.0, "mass": 1.0,
            "inertia": 1.0, "parent": -1, "position": (0, 0, 0), "quaternion": (1, 0, 0, 0),
        },
    ),
}  # fmt: skip
PAIRS = {
    "at": {"closing": 1.0, "sliding": 0.1},
    "chi": {"normal_mass": 1.0, "tangential_mass": 1.0},
    "psi": {"tangential_velocity": 1.0, "normal_velocity": 1.0},
    "greatest_overlap": {"mass": 1.0, "speed": 1.0},
    "contact_duration": {"mass": 1.0, "speed": 1.0},
    "greatest_force": {"mass": 1.0, "speed": 1.0},
    "parameters": {"radius": 1.0, "nodes": 16},
}
PLACE = {"at": (0, 0, 0), "quaternion": (1, 0, 0, 0)}
WORLD = {
    "add_body": {"mass": 1.0, "inertia": 1.0, "position": (0, 0, 0), "velocity": (0, 0, 0), "spin": (0, 0, 0)},
    "add_sphere": {"body": 0, "radius": 1.0, "at": (0, 0, 0)},
    "add_capsule": {"body": 0, "radius": 1.0, "half_length": 1.0, "at": (0, 0, 0), "axis": (0, 0, 1)},
    "add_box": {"body": 0, "half_lengths": (1, 1, 1), "rounding": 0.1, **PLACE},
    "add_cylinder": {"body": 0, "radius": 1.0, "half_length": 1.0, "rounding": None, "axis": (0, 0, 1)},
    "add_ellipsoid": {"body": 0, "half_axes": (1, 1, 1), **PLACE},
    "add_hull": {"body": 0, "points": np.eye(4, 3), "rounding": None, **PLACE},
    "add_plane": {"body": None, "point": (0, 0, 0), "normal": (0, 0, 1)},
    "add_height_field": {"body": None, "heights": np.zeros((3, 3)), "half_lengths": (1, 1), **PLACE},
    "add_contact": {"shapes1": 0, "shapes2": 1, "pair": PAIR},
    "place": {"body": 0, "position": (0, 0, 0), "velocity": (0, 0, 0), "quaternion": (1, 0, 0, 0), "spin": (0, 0, 0)},
    "add_tree": {"tree": TREE, "q": [0.0], "v": [0.0]},
    "place_tree": {"tree": 0, "q": [0.0], "v": [0.0]},
    "step": {"n": 0},
}


@pytest.mark.heavy
@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_name_what_they_refuse(name):
    check_odd_arguments(*FUNCTIONS[name])


@pytest.mark.heavy
@pytest.mark.parametrize("name", PAIRS)
@pytest.mark.parametrize("pair", [PAIR, CURVED], ids=["numbers", "curves"])
def test_methods_of_a_pair_name_what_they_refuse(pair, name):
    check_odd_arguments(getattr(pair, name), PAIRS[name])


@pytest.mark.parametrize("name", [name for name, law in KNOWN.items() if law.__module__.startswith("contactlaw.")])
def test_laws_name_what_they_refuse(name):
    given = {field.name: field.default for field in fields(KNOWN[name])}
    check_odd_arguments(KNOWN[name], given)


@pytest.mark.heavy
def test_calibrate_names_what_it_refuses():
    pytest.importorskip("scipy")
    check_odd_arguments(calibrate, IMPACTS)


@pytest.mark.heavy
@pytest.mark.parametrize("name", WORLD)
def test_worlds_name_what_they_refuse(name):
    def call(**named):
        world = World()
        world.add_sphere(world.add_body(1.0, 1e-3), 0.1)
        world.add_plane(None, (0, 0, -1), (0, 0, 1))
        world.add_tree(TREE)
        getattr(world, name)(**named)

    check_odd_arguments(call, WORLD[name], {"radius": "rounding", "half_length": "rounding"})
