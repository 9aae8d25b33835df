"""Elastic materials, and a table of named ones with the source of each number."""

from dataclasses import dataclass, field
from functools import partial
from math import inf, isinf
from typing import Self

from contactlaw import checks

_modulus = partial(checks.number, allowed="> 0 (inf: a rigid body)", low=0.0, high=inf, open_low=True)
_ratio = partial(checks.number, allowed="in (-1, 0.5]", low=-1.0, high=0.5, open_low=True)


@dataclass(frozen=True)
class Material:
    """A linearly elastic, isotropic material.

    Attributes:
        youngs_modulus: E [Pa], > 0; infinite for a rigid body.
        poissons_ratio: nu, in (-1, 0.5].
        density: rho [kg/m^3], or None if not needed.
        name: Name in tables and messages.
        source: Source of the numbers.

    Raises:
        ValueError: A value is outside its range; the message names it.
    """

    youngs_modulus: float
    poissons_ratio: float
    density: float | None = None
    name: str = ""
    source: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        checks.set_fields(self, youngs_modulus=_modulus, poissons_ratio=_ratio, density=checks.positive)

    @classmethod
    def from_shear_modulus(
        cls, shear_modulus: float, poissons_ratio: float, density: float | None = None, name: str = "", source: str = ""
    ) -> Self:
        """Return the material of shear modulus G [Pa] and Poisson's ratio nu: E = 2 (1 + nu) G."""
        shear, ratio = _modulus("shear_modulus", shear_modulus), _ratio("poissons_ratio", poissons_ratio)
        return cls(2.0 * (1.0 + ratio) * shear, ratio, density, name, source)

    @property
    def shear_modulus(self) -> float:
        """G = E/(2 (1 + nu)) [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poissons_ratio))

    @property
    def is_rigid(self) -> bool:
        """Whether the material does not deform (E is infinite)."""
        return isinf(self.youngs_modulus)

    @property
    def normal_compliance(self) -> float:
        """(1 - nu^2)/E [1/Pa], the contribution of the body to 1/E*."""
        return (1.0 - self.poissons_ratio**2) / self.youngs_modulus

    @property
    def tangential_compliance(self) -> float:
        """(2 - nu)/(4 G) [1/Pa], the contribution of the body to 1/G*."""
        return (2.0 - self.poissons_ratio) / (4.0 * self.shear_modulus)


RIGID = Material(inf, 0.5, name="rigid", source="no deformation: E infinite in both effective moduli")


class UnknownMaterial(KeyError):
    """No material has this name; the message suggests the nearest one."""

    def __str__(self) -> str:
        return str(self.args[0])


class Materials(dict[str, Material]):
    """Dictionary of materials by name."""

    def __missing__(self, name: object) -> Material:
        raise UnknownMaterial(f"no material {name!r}: must be one of {', '.join(self)}{checks.hint(name, self)}")


_KHARAZ = "as used for Kharaz, Gorham & Salman, Powder Technol. 120 (2001) 281, by the Lethe and MFIX examples"

_TABLE = {
    "steel": (2.034e11, 0.28, 7833.0,
        "E (29.5e6 psi) and rho (0.283 lb/in^3): suppliers' data for AISI 52100 ball steel; "
        "nu: Maw, Barber & Fawcett, J. Lubr. Technol. 103 (1981) 74, Fig. 1"),
    "rubber": (4.0e6, 0.5, 1100.0,
        "nu: Maw, Barber & Fawcett (1981), Fig. 5; E and rho: within the 0.7 to 4.1 MPa and 960 to 1280 kg/m^3 "
        "tabulated for vulcanised rubber; grades differ widely, measure yours"),
    "glass": (7.0e10, 0.25, 2500.0,
        f"soda-lime glass, {_KHARAZ}"),
    "aluminium": (7.0e10, 0.33, 2700.0,
        "aluminium alloy of the benchmarks of Chung & Ooi, Granul. Matter 13 (2011) 643, test 4, as in YADE"),
    "alumina": (3.8e11, 0.23, 4000.0,
        f"aluminium oxide, {_KHARAZ}"),
    "tungsten carbide": (6.3e11, 0.24, 15000.0,
        "cemented tungsten carbide, MakeItFrom.com property sheet 'Tungsten Carbide (WC)'"),
    "cellulose acetate": (3.2e9, 0.28, 1319.0,
        "rho: Foerster, Louge, Chang & Allia, Phys. Fluids 6 (1994) 1108 (Louge's impact chart); E and nu: "
        "attributed to Mullier, Tuzun & Walton, Powder Technol. 65 (1991) 61, not checked against the original; "
        "handbooks give E from 1 to 3 GPa"),
    "wood": (1.83e9, 0.42, 706.0,
        "sugar maple at 12 % moisture met across the grain, radially: 1.1 times E_L = 12.6 GPa in bending, "
        "E_R/E_L = 0.132, nu the mean of nu_RL = 0.065 and nu_RT = 0.774, specific gravity 0.63 dry: Wood "
        "Handbook, USDA FPL-GTR-282, tables 5-1 to 5-3. Along the grain it is seven times as stiff"),
    "concrete": (3.3e10, 0.2, 2400.0,
        "C30/37: E_cm = 22 GPa (f_cm/10 MPa)^0.3 at f_cm = 38 MPa, nu uncracked: Eurocode 2, EN 1992-1-1, 3.1.3 "
        "and table 3.1; rho: normal-weight concrete, EN 206, 2000 to 2600 kg/m^3"),
    "nylon": (2.9e9, 0.39, 1130.0,
        "polyamide, dry: E (2.62 to 3.2 GPa) and rho: M. F. Ashby, Materials and the Environment; nu: W. D. "
        "Callister, Materials Science and Engineering, table B.3, nylon 6,6. Moist nylon 6,6 has half the E"),
    "PMMA": (3.2e9, 0.39, 1180.0,
        "E: MakeItFrom.com property sheet 'Polymethylmethacrylate (PMMA, Acrylic)'; rho, and nu from the speeds of "
        "longitudinal and shear waves, 2670 and 1120 m/s: acrylic resin in ASTM E494, table X3.1"),
    "ice": (9.2e9, 0.328, 917.0,
        "polycrystalline, -16 C: Hill's mean of the constants of the crystal, c11, c12, c13, c33, c44 = 13.929, "
        "7.082, 5.765, 15.010, 3.014 GPa, of P. H. Gammon and others, J. Glaciol. 29 (1983) 433"),
    "cork": (2.0e7, 0.05, 170.0,
        "met radially: L. J. Gibson, K. E. Easterling & M. F. Ashby, Proc. R. Soc. A 377 (1981) 99, E 20 MPa "
        "(13 MPa across), nu 0 to 0.1; not checked against the original. Elastic up to 5 % strain: O. Anjos, "
        "H. Pereira & M. E. Rosa, Holz Roh Werkst. 66 (2008) 295"),
}  # fmt: skip
"""E [Pa], nu, rho [kg/m^3] and source by name."""

MATERIALS = Materials({name: Material(e, nu, rho, name, text) for name, (e, nu, rho, text) in _TABLE.items()})
"""Named materials; each carries the source of its numbers."""
MATERIALS["rigid"] = RIGID


def material_of(argument: str, value: Material | str, other: str = "a contactlaw.Material") -> Material:
    """Return a material, given itself or by its name in `MATERIALS`; other: what else may be given, for the message."""
    known = MATERIALS.get(value, value) if isinstance(value, str) else value
    if not isinstance(known, Material):
        names = f"{', '.join(MATERIALS)}{checks.hint(value, MATERIALS)}"
        raise ValueError(f"{argument} = {value!r}: must be {other} or one of {names}")
    return known
