"""Laws as files: the registry, how a law is named, what each must keep, and one of the user's own."""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import dataclass, field, fields
from math import sqrt
from pathlib import Path

import numpy as np
import pytest

from contactlaw import LAWS, Body, ContactPair, Law, collide, force_along_path, rebound
from contactlaw.checks import text_of
from contactlaw.jit import jit
from contactlaw.laws import law_of, sectors
from contactlaw.laws.microslip import Microslip, half_line_nodes
from contactlaw.laws.record import CONTACT, PAIR, PAIR_SIZE, ask_energy, ask_stiffness, pair_of
from contactlaw.laws.slip import carried, held
from contactlaw.laws.step import ask, press, reset
from sims.commands import law_choices

ROOT = Path(__file__).parent.parent
LADDER = ["coulomb", "linear_spring", "mindlin", "mindlin_rescaled", "microslip"]
DERIVED = {"microslip": ["microslip_turning"]}


@dataclass(frozen=True)
class OwnMindlin(Law):
    """Mindlin's spring as a user would write it."""

    name = "own_mindlin"
    source = "a user's own file"
    factor: float = field(default=1.0)

    @staticmethod
    def force(contact, law, memory, du, dv, dt):
        part = 1.0 if contact.before >= 0.0 else contact.overlap / (contact.overlap - contact.before)
        a, b = sqrt(contact.radius * max(contact.before, 0.0)), sqrt(contact.radius * contact.overlap)
        stiffness = 4.0 / 3.0 * law.factor * contact.g_star * (a * a + a * b + b * b) / (a + b)
        f, g = memory[0, 0] + part * stiffness * du, memory[1, 0] + part * stiffness * dv
        share = held(contact, f, g)
        memory[0, 0], memory[1, 0] = share * f, share * g
        return carried(contact, memory[0, 0], memory[1, 0])


def pair_with(law: str | Law, **changes: float) -> ContactPair:
    return ContactPair("steel", "steel", **{"friction": 0.1, "radius": 0.02} | changes, law=law)  # type: ignore[arg-type]


def test_registry_holds_the_ladder_in_order() -> None:
    assert list(LAWS) == LADDER
    assert all(law.name == name and len(law.source) > 10 for name, law in LAWS.items())


def test_a_law_without_a_rung_stands_beside_the_ladder() -> None:
    assert text_of(law_of("microslip_turning node_count=8")) == "microslip_turning node_count=8"
    assert "microslip_turning" not in LAWS


def test_a_law_of_the_users_own_is_found_by_its_name() -> None:
    assert law_of("own_mindlin factor=0.5") == OwnMindlin(factor=0.5)
    assert "own_mindlin factor=..." in law_choices()


@pytest.mark.parametrize("law", [*LAWS.values(), Microslip(7), OwnMindlin(0.25)], ids=lambda law: text_of(law))
def test_a_law_is_told_in_words_and_read_again(law: Law) -> None:
    assert law_of(text_of(law)) == law
    assert pair_with(text_of(law)) == pair_with(law)


def test_a_class_in_place_of_a_law_is_told_so() -> None:
    with pytest.raises(ValueError, match=r"law = OwnMindlin: .* or an instance of the class: OwnMindlin\("):
        pair_with(OwnMindlin)  # type: ignore[arg-type]


@pytest.mark.parametrize(("wrong", "meant"), [("microslp", "microslip"), ("Mindlin", "mindlin"), ("colomb", "coulomb")])
def test_unknown_law_offers_the_nearest_name(wrong: str, meant: str) -> None:
    with pytest.raises(ValueError, match=f"law = {wrong!r}.*did you mean {meant!r}"):
        law_of(wrong)


@pytest.mark.parametrize("wrong", [None, 4, Microslip, ["microslip"], "", "  "])
def test_things_that_are_no_law_are_refused(wrong: object) -> None:
    with pytest.raises(ValueError, match=r"law = .*must be one of coulomb"):
        law_of(wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(("text", "said"), [
    ("microslip nodes=3", "field of microslip = 'nodes': must be one of node_count"),
    ("microslip node_count=many", "'many' must be a number"),
    ("microslip node_count", "'' must be a number"),
    ("microslip node_count=1", "from 2 to 512"),
    ("own_mindlin factor=nan", "factor = nan: must be a finite number"),
])  # fmt: skip
def test_fields_that_cannot_be_are_named(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        law_of(text)


@pytest.mark.parametrize("count", [1, 0, -3, 513, 8.0, "8"])
def test_bad_node_counts_are_refused(count: object) -> None:
    with pytest.raises(ValueError, match=r"node_count = .*from 2 to 512"):
        Microslip(count)  # type: ignore[arg-type]


def test_nodes_are_those_of_gauss() -> None:
    nodes, weights = half_line_nodes(5)
    for power in range(10):  # Gauss-Legendre: exact to degree 2n - 1
        assert (weights * nodes**power).sum() == pytest.approx(1.0 / (power + 1), rel=1e-13)
    assert pair_with(Microslip(5)).parameters().size == PAIR_SIZE + 3 * 5


@pytest.mark.parametrize("name", LAWS)
def test_a_pair_is_its_record_and_the_laws_own_numbers(name: str) -> None:
    pair, law = pair_with(name), LAWS[name]
    p = pair.parameters()
    known = pair_of(p)
    assert (known.e_star, known.radius, known.friction) == (pair.effective_modulus, 0.02, 0.1)
    assert known.vectors == law.memory
    assert pair.memory_size == (max(2 * law.memory, sectors.NUMBERS) if law.sectors else 2 * law.memory)
    assert p.size == len(PAIR.names or ()) + law.numbers().dtype.itemsize // 8


@pytest.mark.parametrize("name", LAWS)
def test_a_law_and_its_name_mean_the_same(name: str) -> None:
    assert law_of(name) is law_of(LAWS[name])
    assert rebound(0.7, 1.2, law=name) == rebound(0.7, 1.2, law=LAWS[name])


@jit
def shear(p, header, memory, overlap, slide):
    """A contact pressed to an overlap [m], then sheared [m]: its force, its stiffness, its energy."""
    contact, pair, law = header[0], pair_of(p), p[PAIR_SIZE:]
    reset(contact, pair, pair.radius)
    contact.mass, contact.tangential_mass, contact.closing = 0.5, 0.2, 0.0
    contact.before, contact.overlap = -1e-9, overlap
    press(contact, pair, 1e-6)
    ask(contact, pair, law, memory, 0.0, 0.0, 1e-6)
    contact.before = overlap
    press(contact, pair, 1e-6)
    ask(contact, pair, law, memory, slide, 0.0, 1e-6)
    return contact.f, ask_stiffness(pair, contact, law), ask_energy(pair, contact, law, memory)


def sheared(law: str, overlap: float = 1e-5, share: float = 0.3) -> tuple[float, float, float, float]:
    """Slide [m], a share of that at which all slips, and what `shear` returns."""
    pair = pair_with(law)
    slide = share * pair.friction / pair.kappa * overlap
    return slide, *shear(pair.parameters(), *pair.law.with_nodes(None).new_contact(), overlap, slide)


@pytest.mark.parametrize("name", [*LADDER[1:], "own_mindlin"])
def test_stiffness_and_energy_belong_to_the_force(name: str) -> None:
    """k_T, all stuck, is the slope of the force at small slides; what is stored is no more than the work done."""
    slide, force, stiffness, energy = sheared(name, share=1e-3)
    assert force / slide == pytest.approx(stiffness, rel=1e-6 if name != "microslip" else 2e-2)
    slide, force, stiffness, energy = sheared(name)
    assert force <= stiffness * slide * (1 + 1e-9) or name == "microslip"
    assert 0.7 * force * slide / 2 < energy <= 0.5 * force * slide * (1 + 1e-6)


def test_rigid_friction_is_rigid_and_stores_nothing() -> None:
    _, _, stiffness, energy = sheared("coulomb")
    assert stiffness == np.inf and energy == 0.0
    assert LAWS["coulomb"].memory == 0


@pytest.mark.parametrize("psi_1", [0.4, 1.5, 3.0, 6.0])
def test_a_law_of_ones_own_gives_what_the_packages_does(psi_1: float) -> None:
    """Both springs differ in how a slide from the touch on is followed: by the first order of a step."""
    own, known = pair_with(OwnMindlin(), radius=0.02), pair_with("mindlin", radius=0.02)
    body = Body(0.5, 0.02, velocity=(psi_1 * 0.1 / known.kappa, 0.0, -1.0))
    assert collide(own, body).psi_2 == pytest.approx(collide(known, body).psi_2, abs=2e-2)
    coarse = rebound(psi_1, 1.256, OwnMindlin(), steps=512)
    assert coarse == pytest.approx(rebound(psi_1, 1.256, "mindlin"), abs=2e-2)
    t = np.linspace(0.0, 1.0, 40)
    overlap, slide = 1e-5 * np.sin(3.0 * t), np.column_stack([2e-7 * t, -4e-7 * np.sin(2.0 * t)])
    for one, two in zip(force_along_path(own, overlap, slide), force_along_path(known, overlap, slide), strict=True):
        np.testing.assert_allclose(one, two, atol=1e-9 * np.abs(two).max())


def test_fields_reach_the_force() -> None:
    slide = np.array([0.0, 0.0, 1e-9])
    full, half = (force_along_path(pair_with(OwnMindlin(x)), np.array([0.0, 1e-5, 1e-5]), slide)[1] for x in (1.0, 0.5))
    assert half[-1] == pytest.approx(0.5 * full[-1], rel=1e-12)
    assert [one.name for one in fields(OwnMindlin)] == ["factor"]


@pytest.mark.heavy
@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
def test_a_law_of_ones_own_runs_in_the_engines_without_compiling_them(engine: str) -> None:
    pytest.importorskip(engine)
    from sims.scene import Settings
    from sims.worlds import new_world

    def bounce(law: Law | str) -> np.ndarray:
        world = new_world(Settings(engine))
        world.ball("ball", 0.02, 0.5, [0.0, 0.0, 0.0201], velocity=[0.15, 0.0, -1.0])
        world.plane("floor")
        world.contact("ball", "floor", pair_with(law))
        track = world.record(0.02).track("ball")
        return np.concatenate([track.velocities[-1], 0.02 * track.spins[-1]])

    known = bounce("mindlin")
    before = compiled_functions(engine)
    own = bounce(OwnMindlin())
    assert compiled_functions(engine) == before
    np.testing.assert_allclose(own, known, atol=2e-3)
    assert np.abs(own - bounce(OwnMindlin(0.2))).max() > 1e-2


def compiled_functions(engine: str) -> int:
    """How many signatures of what steps contacts are compiled."""
    own = (f"contactlaw.{engine}", "contactlaw.world", "contactlaw.single")
    modules = [sys.modules[name] for name in sys.modules if name.startswith(own)]
    functions = [getattr(module, name) for module in modules for name in dir(module)]
    return sum(len(one.signatures) for one in functions if hasattr(one, "signatures"))


@pytest.mark.parametrize("gone", LADDER)
def test_a_package_without_one_of_its_laws_works(gone: str, tmp_path: Path) -> None:
    """Without its file, and those of laws derived from it, the rest works; a pair's default must then be another."""
    shutil.copytree(ROOT / "contactlaw", tmp_path / "contactlaw", ignore=shutil.ignore_patterns("__pycache__"))
    for name in (gone, *DERIVED.get(gone, ())):
        (tmp_path / "contactlaw" / "laws" / f"{name}.py").unlink()
    code = f"""
from contactlaw import LAWS, MATERIALS, Body, ContactPair, collide, force_along_path, rebound
assert list(LAWS) == {[name for name in LADDER if name != gone]!r}, list(LAWS)
for law in LAWS:
    pair = ContactPair(MATERIALS["steel"], MATERIALS["steel"], 0.1, radius=0.02, law=law)
    assert abs(collide(pair, Body(0.5, 0.02, velocity=(0.1, 0, -1)), steps=40).psi_2) < 2
    assert abs(rebound(0.5, 1.2, law, steps=16)) < 1
    assert force_along_path(pair, [0.0, 1e-5], [0.0, 1e-7])[1][-1] > 0
"""
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False,
        env={"NUMBA_DISABLE_JIT": "1", "PATH": ""},
    )  # fmt: skip
    assert run.returncode == 0, run.stderr


def test_nothing_asks_a_law_for_its_name() -> None:
    """What steps contacts compares with no law of the package."""
    for path in [ROOT / "contactlaw" / "single.py", *(ROOT / "contactlaw" / "world").rglob("*.py")]:
        text = path.read_text(encoding="utf-8")
        assert not [name for name in LADDER if f"laws.{name}" in text or f'"{name}"' in text], path
    assert "code" not in (CONTACT.names or ())


@pytest.mark.heavy
def test_a_law_that_uses_more_memory_than_it_has_is_named() -> None:
    """Compiled code would write it over what belongs to others, and end the process some time later."""

    class Forgetful(Law):
        @staticmethod
        def force(contact, law, memory, du, dv, dt):
            memory[0, 1] = du
            return memory[0, 1], 0.0

    with pytest.raises(IndexError, match=r"Forgetful\.force: memory = 1, of shape \(2, 1\): index is out of bounds"):
        rebound(0.5, 1.2, Forgetful())


@pytest.mark.heavy
def test_a_law_that_does_not_compile_is_named() -> None:
    class Misspelt(Law):
        @staticmethod
        def force(contact, law, memory, du, dv, dt):
            return contact.frocce * du, 0.0

    with pytest.raises(TypeError, match=r"Misspelt\.force: numba cannot compile it: KeyError: 'frocce', no field of"):
        pair_with(Misspelt()).parameters()

    class Short(Law):
        @staticmethod
        def force(contact, law, memory, du, dv):  # type: ignore[override]
            return 0.0, 0.0

    form = r"take \(contact, law, memory, du, dv, dt\), and return two numbers"
    with pytest.raises(TypeError, match=rf"Short\.force: .*takes 5 arguments.*; must be a static method, {form}"):
        pair_with(Short()).parameters()


@pytest.mark.heavy
def test_a_law_that_exceeds_coulombs_limit_is_refused() -> None:
    """Nothing else keeps the limit: such a law left impacts of steel at psi_2 = 3.5."""

    class Gluing(Law):
        @staticmethod
        def force(contact, law, memory, du, dv, dt):
            memory[0, 0] += contact.g_star * du
            return memory[0, 0], 0.0

    with pytest.raises(ValueError, match=r"Gluing\.force: returns up to 1e\+06 mu P; must be at most mu P"):
        pair_with(Gluing()).parameters()


def test_a_field_that_is_no_number_is_named() -> None:
    with pytest.raises(ValueError, match=r"factor = None: must be a finite number"):
        OwnMindlin(None)  # type: ignore[arg-type]


@pytest.mark.heavy
def test_a_law_whose_force_is_not_finite_is_named() -> None:
    class Divided(Law):
        @staticmethod
        def force(contact, law, memory, du, dv, dt):
            return du / (contact.overlap - contact.overlap), 0.0

    steel, slow = pair_with(Divided()), (np.array([0.0, 1e-5]), np.array([0.0, 1e-7]))
    for impact in (
        lambda: rebound(0.5, 1.2, Divided()),
        lambda: collide(steel, Body(mass=0.5, radius=0.025, velocity=(0.05, 0.0, -1.0))),
        lambda: force_along_path(steel, *slow),
    ):
        with pytest.raises(ValueError, match=r"Divided: its force is not finite somewhere on the way"):
            impact()


@pytest.mark.parametrize("name", ["mindlin", "my law", "", 5, None])
def test_a_name_that_text_cannot_tell_is_refused(name: object) -> None:
    """MuJoCo's XML names laws by text: a law of one's own named "mindlin" acted there as the package's."""
    with pytest.raises(ValueError, match=rf"Own\.name = {name!r}: must be one word, and not the name of a law of"):
        type("Own", (Law,), {"name": name})
    with pytest.raises(ValueError, match=r"Own\.name = 'microslip': must be one word, and not"):
        type("Own", (Microslip,), {})


def test_a_law_without_a_force_or_with_no_whole_memory_is_refused() -> None:
    class Forceless(Law):
        pass

    class Number(Law):
        force = 5  # type: ignore[assignment]

    class Half(Law):
        memory = 2.5
        force = OwnMindlin.force

    with pytest.raises(TypeError, match=r"Forceless: has no force\(contact, law, memory, du, dv, dt\)"):
        Forceless()
    with pytest.raises(TypeError, match=r"Number: has no force\("):
        Number()
    with pytest.raises(ValueError, match=r"Half\.memory = 2\.5: must be an integer"):
        Half()
