"""The class `Scene`, its settings, and the registry of all scenes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType, SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar

from contactlaw import MATERIALS, ContactPair, checks
from contactlaw.laws import law_of
from sims.options import Option
from sims.recording import Recording
from sims.registry import Limit, Registry

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENGINES = ("mujoco", "pybullet")
NONE = "none"
"""Name of the package's own world, where an engine is asked for."""
EVERYWHERE = (*ENGINES, NONE)
"""Where a scene of balls and planes runs."""
OWN_STEP = {"mujoco": 2e-3, "pybullet": 1.0 / 240.0, NONE: 2e-3}
"""The step [s] that an engine has unless told otherwise."""
NATIVE, NATIVE_DAMPED = NATIVES = ("native", "native_damped")
"""Names of the engine's own contact, where a law is asked for: set for its restitution; for its friction (MuJoCo)."""
LEAST_STEP, LONGEST_STEP = 1e-8, 0.05  # [s], on the command line
Measured = dict[str, Any]
"""What a scene measured, as --json prints it: JSON types only."""


Mark = tuple[float, float, str]
"""A short text below a point in the plane of the picture [m]."""


def signed(value: float, digits: int) -> str:
    """Format a number with its sign, for pictures; never as a negative zero."""
    text = f"{value:+.{digits}f}".replace("-", "\N{MINUS SIGN}")
    return text if any(digit in text for digit in "123456789") else text[1:]


def plain(value: float, digits: int) -> str:
    """Format a number to some significant digits, for pictures, without a power of ten for large ones."""
    return f"{value:.0f}" if abs(value) >= 10.0**digits else f"{value:.{digits}g}"


def _no_progress(_: float) -> None:
    """Ignore progress."""


def check_law(law: str) -> None:
    """Raise ValueError unless the text names a law, with its fields, or the engine's own contact."""
    if law not in NATIVES:
        law_of(law)


def check_step(timestep: float | None) -> None:
    """Raise ValueError if a step [s] is outside the range for scenes."""
    if timestep is not None:
        low, high = LEAST_STEP, LONGEST_STEP
        checks.number("timestep", timestep, f"in [{low:g}, {high:g}] s", low=low, high=high)


@dataclass(frozen=True)
class Settings:
    """Settings of a run.

    Attributes:
        engine: "mujoco", "pybullet", or "none" for the package's own world. law: Law as `contactlaw.laws.law_of` takes
        it, or "native" for the engine's own contact; None: that of the pairs. material: Name in `contactlaw.MATERIALS`;
        None: the scene's own. timestep: Engine step [s]; None: the engine's own. options: The scene's own options by
        name; those not given have the scene's defaults. watch: Slow-motion factor in the engine's own window; 0: no
        window. progress: Called now and then with the share of the run that is done, 0 to 1.

    Raises:
        ValueError: A value outside what is allowed; the message names it.
    """

    engine: str = "mujoco"
    law: str | None = None
    material: str | None = None
    timestep: float | None = None
    options: Mapping[str, float | None] = field(default_factory=lambda: MappingProxyType({}))
    watch: float = 0.0
    progress: Callable[[float], None] = field(default=_no_progress, repr=False, compare=False)

    def __post_init__(self) -> None:
        checks.one_of("engine", self.engine, EVERYWHERE)
        if self.law is not None:
            check_law(self.law)
        if self.material is not None:
            checks.one_of("material", self.material, MATERIALS)
        if self.timestep is not None:
            checks.positive("timestep", self.timestep)
        checks.not_negative("watch", self.watch)

    @property
    def step(self) -> float:
        """Engine step [s]."""
        return OWN_STEP[self.engine] if self.timestep is None else self.timestep

    def by_law(self, pair: ContactPair) -> ContactPair:
        """A pair by the law asked for, or by its own."""
        return pair if self.law is None else replace(pair, law=self.law)


class Scene(ABC):
    """A small simulation that shows something, and checks itself.

    To add a scene, put one file into sims/scenes with a subclass of this, decorated with `register`:
      1. `name` (that of its command) and `title`, one line for `python -m sims list`;
      2. `engines`, and in `unable` the reason for each engine that cannot run it;
      3. `shown`, `exposure`, `slow` where the defaults do not make a good picture;
      4. `options`: its own numbers (`sims.options`; `of_ball` if it has a ball); each becomes an option of its
         command;
      5. `simulate`: build it with `sims.worlds.new_world`, run it, and return the recording; its pairs have the
         simplest law that gives the same result (`leave_out` in validation measures what that saves and changes);
      6. `measure`: the results, from the recording alone, whose facts include all options and the material;
         `check`: the limits that they must keep.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    engines: ClassVar[tuple[str, ...]] = ENGINES
    unable: ClassVar[dict[str, str]] = {}
    options: ClassVar[dict[str, Option]] = {}
    material: ClassVar[str | None] = "steel"
    """Default material; None: the scene has fixed materials."""
    shown: ClassVar[float | None] = None
    """Time that its pictures show [s]; None: all of the recording."""
    exposure: ClassVar[float | None] = None
    """Time between two exposures of the stroboscope [s]; None: so that there are 16."""
    beside_native: ClassVar[bool] = True
    """Whether its pictures show the engine's own contact beside the law."""
    native_step: ClassVar[float | None] = None
    """Step [s] of the engine's own contact in the pictures, where bodies pass through each other at the usual step."""
    beside_damped: ClassVar[bool] = False
    """Whether its pictures also show MuJoCo's own contact with the best settings for friction."""
    apart: ClassVar[bool] = False
    """Whether exposures stand side by side, for bodies that hide each other."""
    in_window: ClassVar[bool] = True
    """Whether `World.record` runs it, which can show it in the engine's window."""
    slow: ClassVar[float] = 1.0
    """Slow-motion factor of its animation."""

    def run(self, settings: Settings) -> Recording:
        """Simulate and record.

        Raises:
            ValueError: A setting outside what the scene allows; the message names it.
        """
        told = self.demand(settings)
        recording = self.simulate(replace(settings, material=told["material"] or None), SimpleNamespace(**told))
        recording.facts = told | recording.facts
        return recording

    @abstractmethod
    def simulate(self, settings: Settings, o: Any) -> Recording:
        """Build and run the scene; o: what `demand` returns, as attributes."""

    @abstractmethod
    def measure(self, recording: Recording) -> Measured:
        """Results of the scene, as `--json` prints them."""

    @abstractmethod
    def check(self, measured: Measured) -> list[Limit]:
        """Limits on the results; fewer where the law is not `microslip`."""

    def marks(self, recording: Recording, entry: int = -1) -> list[Mark]:
        """Short texts for its pictures; if exposures stand side by side, those of one entry."""
        return []

    def caption(self, recording: Recording) -> str:
        """Line below its pictures."""
        return ""

    def ideals(self, recording: Recording) -> list[tuple[str, Recording]]:
        """Ideal motions to show beside the law, each with a title."""
        return []

    def figure(self, settings: Settings, recording: Recording) -> Figure | None:
        """Picture of its own, in place of the exposures."""
        return None

    def demand(self, settings: Settings) -> dict[str, Any]:
        """All options and the material, as given or by default.

        Raises:
            ValueError: The scene cannot be run with these settings.
        """
        checks.one_of("engine", settings.engine, [*self.engines, *self.unable])
        if settings.engine in self.unable:
            raise ValueError(f"engine = {settings.engine!r}: cannot do {self.name}: {self.unable[settings.engine]}")
        if settings.law == NATIVE_DAMPED and (settings.engine != "mujoco" or not self.beside_damped):
            able = ", ".join(name for name, one in SCENES.items() if one.beside_damped)
            raise ValueError(f"law = {settings.law!r}: is for {able} in mujoco")
        if settings.law in NATIVES and settings.engine == NONE:
            raise ValueError(f"law = {settings.law!r}: engine = {NONE!r} has no contact of its own")
        if settings.material and self.material is None:
            raise ValueError(f"material = {settings.material!r}: {self.name} has materials of its own")
        for name in settings.options:
            checks.one_of("option", name, self.options)
        told = {name: option.read(name, settings.options.get(name)) for name, option in self.options.items()}
        return {"material": settings.material or self.material} | told


_REGISTRY: Registry[Scene] = Registry("sims.scenes", "scene")
SCENES = _REGISTRY.known
"""Every scene by its name; filled by `find_scenes`."""
register, find_scenes = _REGISTRY.register, _REGISTRY.find
