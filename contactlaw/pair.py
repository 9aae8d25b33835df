"""`ContactPair`: two materials in contact, their friction and restitution, and the contact law."""

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlaw import checks, losses
from contactlaw.laws import Law, hertz, law_of, normal_motion, oscillator, sectors
from contactlaw.laws.base import MOST_VECTORS
from contactlaw.losses import OverSpeed
from contactlaw.material import Material, material_of

COUPLING_TO_MENTION = 0.2  # Dundurs-type constant beyond which a pair warns
DEEPEST = 0.1  # overlap over radius, up to which a contact counts as small (Hertz)
TOO_DEEP = f"overlap over radius is {{:.2g}}: beyond {DEEPEST} Hertz contact is no longer right"
PASSING = "so deep in each other that no normal is unique: they pass through each other until they have parted"
FOUND_IN = "found in each other by {:.2g} of the radius: they count as just touching"


class ContactWarning(UserWarning):
    """A contact is outside the range that the theory covers fully; the message says how far results still hold."""


@dataclass(frozen=True)
class ContactPair:
    """Two materials in contact, their friction and restitution, and the contact law.

    Attributes:
        a, b: The materials, or their names in `MATERIALS`; at most one rigid.
        friction: Coulomb coefficient mu >= 0, or a function of the sliding speed from `contactlaw.losses`.
        restitution: e in [1e-6, 1], the same at any speed, or a function of the approach speed from
            `contactlaw.losses`.
        radius: Effective radius R [m], 1/R = 1/R_A + 1/R_B; None: read from the geoms.
        law: A law, or its name in `LAWS`, followed by the fields that differ from their defaults
            ("microslip node_count=32").
        stiffness_ratio: kappa = k_T/k_N; None: G*/E* of the materials.
        rolling_resistance: Coefficient mu_r >= 0 of the moment mu_r R P against rolling (`laws.rolling`), R the
            effective radius along the way that it rolls.

    Raises:
        ValueError: A value is outside its range; the message names it.
    """

    a: Material
    b: Material
    friction: Any
    restitution: Any = 1.0
    radius: float | None = None
    law: Law = "microslip"  # type: ignore[assignment]
    stiffness_ratio: float | None = None
    rolling_resistance: float = 0.0

    if TYPE_CHECKING:  # the constructor takes names of materials and laws and replaces them by what they name

        def __init__(
            self, a: Material | str, b: Material | str, friction: float | OverSpeed,
            restitution: float | OverSpeed = 1.0, radius: float | None = None, law: str | Law = "microslip",
            stiffness_ratio: float | None = None, rolling_resistance: float = 0.0,
        ) -> None: ...  # fmt: skip

    def __post_init__(self) -> None:
        checks.set_fields(self, a=material_of, b=material_of)
        if self.a.is_rigid and self.b.is_rigid:
            raise ValueError("a and b are both rigid: at least one must be elastic, or no contact can deform")
        for name, check in (("friction", checks.not_negative), ("restitution", checks.restitution)):
            value = getattr(self, name)
            if isinstance(value, OverSpeed):
                for extreme in (np.min, np.max):
                    check(f"{name} at some speed", float(extreme(value(value.points))))
            elif callable(value):
                raise ValueError(f"{name} = {value!r}: must be a number, or one of contactlaw.losses, such as a Table")
            else:
                object.__setattr__(self, name, check(name, value))
        checks.set_fields(self, rolling_resistance=checks.not_negative, law=lambda _, law: law_of(law))
        checks.set_fields(self, radius=checks.positive, stiffness_ratio=checks.positive)
        if abs(self.coupling) > COUPLING_TO_MENTION:
            warnings.warn(
                f"{self.a.name or 'a'} on {self.b.name or 'b'}: normal and tangential motion are coupled by "
                f"{self.coupling:.2f} (Dundurs-type constant, 0 for equal materials); the law leaves that out",
                ContactWarning,
                stacklevel=3,
            )

    @cached_property
    def effective_modulus(self) -> float:
        """E* [Pa], 1/E* = sum of (1 - nu^2)/E."""
        return 1.0 / (self.a.normal_compliance + self.b.normal_compliance)

    @cached_property
    def effective_shear_modulus(self) -> float:
        """G* [Pa], 1/G* = sum of (2 - nu)/(4 G), or kappa E* if kappa is given."""
        if self.stiffness_ratio is not None:
            return self.stiffness_ratio * self.effective_modulus
        return 1.0 / (self.a.tangential_compliance + self.b.tangential_compliance)

    @cached_property
    def torsion_modulus(self) -> float:
        """G_t [Pa] of torsion about the normal, 1/G_t = 1/G_A + 1/G_B; it does not depend on kappa."""
        return 1.0 / (1.0 / self.a.shear_modulus + 1.0 / self.b.shear_modulus)

    @cached_property
    def kappa(self) -> float:
        """Tangential over normal contact stiffness, k_T/k_N = G*/E*."""
        return self.effective_shear_modulus / self.effective_modulus

    @property
    def coupling(self) -> float:
        """Dundurs-type constant of normal and tangential coupling.

        It is 0 for equal materials and for nu = 1/2 on a rigid body.

        Source: Spence (1968), in the first footnote of Maw, Barber & Fawcett (1981).
        """
        (u, v), (p, r) = ((self.a.poissons_ratio, self.b.poissons_ratio), (self.a.shear_modulus, self.b.shear_modulus))
        return ((1 - 2 * u) / p - (1 - 2 * v) / r) / ((1 - u) / p + (1 - v) / r)

    @cached_property
    def damping_ratio(self) -> float:
        """Damping ratio zeta of the normal damper that gives the restitution (at 1 m/s if it depends on speed).

        The coefficient alpha of Tsuji et al. (1992) is sqrt(5) zeta.
        """
        return oscillator.damping_ratio(self._at(1.0, 0.0)[0])

    def at(self, closing: float, sliding: float = 0.0) -> Self:
        """Return the pair with the restitution and friction of an impact at these closing and sliding speeds [m/s]."""
        if not (isinstance(self.restitution, OverSpeed) or isinstance(self.friction, OverSpeed)):
            return self
        e, mu = self._at(checks.speed("closing", closing, least=0.0), checks.speed("sliding", sliding, least=0.0))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ContactWarning)
            return replace(self, restitution=e, friction=mu)

    def _at(self, closing: float, sliding: float) -> tuple[float, float]:
        """Return restitution and friction at these speeds [m/s]."""
        e, mu = self.restitution, self.friction
        if isinstance(e, OverSpeed):
            e = max(e(closing), checks.LEAST_RESTITUTION)
        return e, mu(sliding) if isinstance(mu, OverSpeed) else mu

    def chi(self, normal_mass: float, tangential_mass: float) -> float:
        """chi = (kappa/2) m_N/m_T for the effective masses at the contact point [kg].

        A sphere-like body of mass M and radius of gyration K (in radii) on a fixed one: m_N = M, m_T = M/(1 + 1/K^2).
        """
        ratio = checks.positive("normal_mass", normal_mass) / checks.positive("tangential_mass", tangential_mass)
        return 0.5 * self.kappa * checks.positive("normal_mass/tangential_mass", ratio)

    def psi(self, tangential_velocity: ArrayLike, normal_velocity: ArrayLike) -> Any:
        """psi = (kappa/mu) V_x/V_z1 for the tangential velocity of the contact point and the approach speed [m/s].

        Both broadcast; a float for two numbers.
        """
        given = {"tangential_velocity": tangential_velocity, "normal_velocity": normal_velocity}
        sliding, approach = checks.broadcast(given)
        least, most = checks.SPEEDS
        for name, values, low in zip(given, (sliding, approach), (-most, least), strict=True):
            for wrong in values[(values < low) | (values > most)][:1]:
                raise ValueError(f"{name} = {wrong}: must be in [{low:g}, {most:g}] m/s")
        friction = self.friction(abs(sliding)) if isinstance(self.friction, OverSpeed) else self.friction
        if np.any(friction == 0.0):
            raise ValueError("friction = 0.0: psi = (kappa/mu) V_x/V_z1 needs friction > 0")
        psi = self.kappa / friction * sliding / approach
        return psi if psi.ndim else float(psi)

    def greatest_overlap(self, mass: float, speed: float) -> float:
        """Greatest overlap [m] of an impact, for the normal effective mass [kg] and approach speed [m/s]."""
        deepest = self._deepest(mass, speed)
        return deepest * oscillator.restitution(self.at(speed).damping_ratio) ** 0.4

    def contact_duration(self, mass: float, speed: float) -> float:
        """Duration of an impact [s], for the normal effective mass [kg] and approach speed [m/s].

        Elastic: 2.943 delta_max/v (Hertz).
        """
        return self._deepest(mass, speed) / speed * _scaled_duration(self.at(speed).damping_ratio)

    def greatest_force(self, mass: float, speed: float) -> float:
        """Greatest normal force [N] of an impact; strong damping may put it at the first touch.

        mass: normal effective mass [kg]. speed: approach speed [m/s].
        """
        unit = self._stiffness() * (self._deepest(mass, speed) / normal_motion.SCALED_DEEPEST) ** 1.5
        return unit * float(normal_motion.normal_motion(self.at(speed).damping_ratio, 2000, False).force.max())

    def _deepest(self, mass: float, speed: float) -> float:
        """Greatest overlap [m] of an undamped impact."""
        m, v = checks.positive("mass", mass), checks.speed("speed", speed)
        return hertz.greatest_overlap(self._stiffness(), m, 0.0, v)

    def _stiffness(self) -> float:
        """k of P = k delta^1.5 [N/m^1.5]."""
        return 4.0 / 3.0 * self.effective_modulus * sqrt(self._radius())

    def _radius(self) -> float:
        if self.radius is None:
            raise ValueError("radius = None: this depends on it; give the pair an effective radius [m]")
        return self.radius

    @property
    def memory_size(self) -> int:
        """How many float64 numbers the history of a contact takes in an engine."""
        law = self.law.with_nodes(None)
        return max(2 * law.memory, sectors.NUMBERS if law.sectors else 0)

    def parameters(self, radius: float | None = None, nodes: int | None = None) -> NDArray[np.float64]:
        """Return the numbers that the kernels read: `laws.record.PAIR`, then the law's own numbers.

        Args:
            radius: Effective radius [m], used if the pair has none.
            nodes: Number of nodes, for a law that leaves it open.
        """
        given = self.radius is not None or radius is None
        return self.law.with_nodes(None if nodes is None else checks.count("nodes", nodes, 0, MOST_VECTORS)).with_pair(
            self.effective_modulus, self.effective_shear_modulus,
            self._radius() if given else checks.positive("radius", radius), self._at(1.0, 0.0)[1], self.damping_ratio,
            _scaled_duration(self.damping_ratio), self.torsion_modulus, self.rolling_resistance,
            speeds=losses.numbers_of(self.restitution, self.friction),
        )  # fmt: skip


def warn_of_depth(overlap: float, radius: float) -> bool:
    """Warn if an overlap [m] is too deep, compared with the radius [m], for Hertz's theory; return whether it is."""
    deep = overlap > DEEPEST * radius
    if deep:
        warnings.warn(TOO_DEEP.format(overlap / radius), ContactWarning, stacklevel=3)
    return deep


def _scaled_duration(zeta: float) -> float:
    """Duration of a damped impact times approach speed over the greatest overlap of the undamped one."""
    return normal_motion.duration(zeta) / normal_motion.SCALED_DEEPEST
