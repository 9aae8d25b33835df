"""Two materials in contact: what the contact law needs to know of them."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactlaw import checks
from contactlaw.kernels import contact, oscillator, rebound
from contactlaw.laws import Law, law_of
from contactlaw.material import Material

COUPLING_TO_MENTION = 0.2
DEEPEST = 0.1  # overlap over radius up to which a Hertz contact is small


class ContactWarning(UserWarning):
    """Something about a contact that the theory does not cover fully; the results still hold as far as stated."""


@dataclass(frozen=True)
class ContactPair:
    """Two materials, how they rub and bounce, and the law of their contact.

    Attributes:
        a, b: The materials; at most one rigid.
        friction: Coulomb coefficient mu, >= 0.
        restitution: e, in (0, 1], the same at any speed.
        radius: Effective radius R [m], 1/R = 1/R_A + 1/R_B; None: read from the geoms.
        law: Name in `LAWS`, or a law.
        stiffness_ratio: kappa = k_T/k_N; None: from the materials, G*/E*.
        static_friction: Coefficient above which a stuck place starts to slip, >= friction; None: the same.

    Raises:
        ValueError: A value outside its range; the message names it.
    """

    a: Material
    b: Material
    friction: float
    restitution: float = 1.0
    radius: float | None = None
    law: str | Law = "microslip"
    stiffness_ratio: float | None = None
    static_friction: float | None = None

    def __post_init__(self) -> None:
        for name, material in (("a", self.a), ("b", self.b)):
            if not isinstance(material, Material):
                raise ValueError(f"{name} = {material!r}: must be a contactlaw.Material")
        if self.a.is_rigid and self.b.is_rigid:
            raise ValueError("a and b are both rigid: at least one must be elastic, or no contact can deform")
        mu = checks.not_negative("friction", self.friction)
        object.__setattr__(self, "friction", mu)
        object.__setattr__(self, "restitution", checks.restitution("restitution", self.restitution))
        if self.radius is not None:
            object.__setattr__(self, "radius", checks.positive("radius", self.radius))
        object.__setattr__(self, "law", law_of(self.law))
        if self.stiffness_ratio is not None:
            object.__setattr__(self, "stiffness_ratio", checks.positive("stiffness_ratio", self.stiffness_ratio))
        if self.static_friction is not None:
            static = checks.not_negative("static_friction", self.static_friction)
            if static < mu:
                raise ValueError(f"static_friction = {static!r}: must be None or >= friction = {mu!r}")
            object.__setattr__(self, "static_friction", static)
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
        """G* [Pa], 1/G* = sum of (2 - nu)/(4 G), or kappa E* where kappa is given."""
        if self.stiffness_ratio is not None:
            return self.stiffness_ratio * self.effective_modulus
        return 1.0 / (self.a.tangential_compliance + self.b.tangential_compliance)

    @cached_property
    def kappa(self) -> float:
        """Tangential over normal contact stiffness, k_T/k_N = G*/E*."""
        return self.effective_shear_modulus / self.effective_modulus

    @property
    def coupling(self) -> float:
        """Dundurs-type constant of normal and tangential coupling; 0 for equal materials, or nu = 1/2 on a rigid body.

        Source: Spence (1968), in the first footnote of Maw, Barber & Fawcett (1981).
        """
        (u, v), (p, r) = ((self.a.poissons_ratio, self.b.poissons_ratio), (self.a.shear_modulus, self.b.shear_modulus))
        return ((1 - 2 * u) / p - (1 - 2 * v) / r) / ((1 - u) / p + (1 - v) / r)

    @cached_property
    def damping_ratio(self) -> float:
        """zeta of the normal damper that gives the restitution; alpha of Tsuji et al. (1992) is sqrt(5) zeta."""
        return oscillator.damping_ratio(self.restitution)

    def chi(self, normal_mass: float, tangential_mass: float) -> float:
        """chi = (kappa/2) m_N/m_T for the effective masses at the contact point [kg].

        A sphere-like body of mass M and radius of gyration K (in radii) on a fixed one: m_N = M, m_T = M/(1 + 1/K^2).
        """
        return 0.5 * self.kappa * checks.positive("normal_mass", normal_mass) / checks.positive(
            "tangential_mass", tangential_mass
        )  # fmt: skip

    def psi(self, tangential_velocity: float, normal_velocity: float) -> float:
        """psi = (kappa/mu) V_x/V_z1 for the contact point's tangential and the approach velocity [m/s]."""
        if self.friction == 0.0:
            raise ValueError("friction = 0.0: psi = (kappa/mu) V_x/V_z1 needs friction > 0")
        sliding = float(checks.finite_array("tangential_velocity", tangential_velocity))
        return self.kappa / self.friction * sliding / checks.positive("normal_velocity", normal_velocity)

    def greatest_overlap(self, mass: float, speed: float) -> float:
        """Greatest overlap [m] of an impact with normal effective mass [kg] and approach speed [m/s]."""
        return self._deepest(mass, speed) * _scaled_impact(self.damping_ratio)[1]

    def contact_duration(self, mass: float, speed: float) -> float:
        """Duration of contact [s]; 2.943 delta_max/v for an elastic impact (Hertz)."""
        return self._deepest(mass, speed) / speed * _scaled_impact(self.damping_ratio)[0]

    def greatest_force(self, mass: float, speed: float) -> float:
        """Greatest normal force [N] of an impact; where the damper dominates this may be at the touch."""
        return self._stiffness() * self._deepest(mass, speed) ** 1.5 * _scaled_impact(self.damping_ratio)[2]

    def _deepest(self, mass: float, speed: float) -> float:
        """Greatest overlap [m] without damping."""
        m, v = checks.positive("mass", mass), checks.positive("speed", speed)
        return contact.greatest_overlap(self._stiffness(), m, 0.0, v)

    def _stiffness(self) -> float:
        """k of P = k delta^1.5 [N/m^1.5]."""
        return 4.0 / 3.0 * self.effective_modulus * sqrt(self._radius())

    def _radius(self) -> float:
        if self.radius is None:
            raise ValueError("radius = None: give the pair an effective radius [m] for this figure")
        return self.radius

    def parameters(
        self, radius: float | None = None, plane: ArrayLike | None = None, nodes: int | None = None
    ) -> NDArray[np.float64]:
        """The pair as the kernels read it (`kernels.contact`).

        Args:
            radius: Effective radius [m] where the pair has none.
            plane: Normal of the plane in which all motion happens, a unit vector; None: motion in space.
            nodes: For a microslip law that leaves their number open; None: 16.
        """
        law = law_of(self.law)
        n = law.nodes_or(nodes)
        p = np.zeros(contact.PARAMETERS + 2 * n)
        p[contact.E_STAR] = self.effective_modulus
        p[contact.G_STAR] = self.effective_shear_modulus
        given = self.radius is not None or radius is None
        p[contact.RADIUS] = self._radius() if given else checks.positive("radius", radius)
        p[contact.FRICTION] = self.friction
        p[contact.STATIC_FRICTION] = self.friction if self.static_friction is None else self.static_friction
        p[contact.ZETA] = self.damping_ratio
        p[contact.DURATION] = _scaled_impact(self.damping_ratio)[0]
        p[contact.LAW] = law.code
        p[contact.NODES] = n
        if plane is not None:
            p[contact.PLANAR] = 1.0
            p[contact.AXIS : contact.AXIS + 3] = checks.unit_vector("plane", plane)
        if n > 1:
            p[contact.PARAMETERS :] = np.concatenate(half_line_nodes(n))
        return p

    def history(self, *, planar: bool = False, nodes: int | None = None) -> NDArray[np.float64]:
        """An empty history of one contact, as `kernels.contact` lays it out; arguments as for `parameters`."""
        n = law_of(self.law).nodes_or(nodes)
        flags = n if self.static_friction is not None and self.static_friction > self.friction else 0
        return np.zeros(contact.HEADER + n * (1 if planar else 2) + flags)


def warn_of_depth(overlap: float, radius: float) -> bool:
    """Say so where an overlap [m] is too deep for the radius [m] to be a Hertz contact. Returns whether it was said."""
    deep = overlap > DEEPEST * radius
    if deep:
        warnings.warn(
            f"overlap over radius is {overlap / radius:.2g}: beyond {DEEPEST} Hertz contact is no longer right",
            ContactWarning,
            stacklevel=3,
        )
    return deep


@lru_cache(maxsize=64)
def half_line_nodes(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gauss-Legendre abscissae and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(count)
    return 0.5 * (x + 1.0), 0.5 * w


def scaled_duration(zeta: float) -> float:
    """Duration of a damped impact, times its speed, over the greatest overlap that it would have undamped."""
    return _scaled_impact(zeta)[0]


@lru_cache(maxsize=64)
def _scaled_impact(zeta: float) -> tuple[float, float, float]:
    """Of a damped impact: duration times speed, greatest overlap and force, over those overlap and force undamped."""
    _, delta, force, _, _, dt = rebound.normal_table(zeta, 2000, False)
    deepest = rebound.SCALED_DEEPEST
    return float(dt.sum() / deepest), float(delta.max() / deepest), float(force.max() / deepest**1.5)
