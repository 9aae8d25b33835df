"""Elastic materials: what a body is made of, and the named ones with the source of each number."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isinf

from contactlaw import checks


@dataclass(frozen=True)
class Material:
    """A linearly elastic, isotropic material.

    Attributes:
        youngs_modulus: E [Pa], > 0; infinite for a rigid body.
        poissons_ratio: nu, in (-1, 0.5].
        density: rho [kg/m^3], or None where nothing needs it.
        name: For tables and messages.
        source: Where the numbers come from.

    Raises:
        ValueError: A value outside its range; the message names it.
    """

    youngs_modulus: float
    poissons_ratio: float
    density: float | None = None
    name: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        modulus = checks.number(
            "youngs_modulus", self.youngs_modulus, "> 0 (inf: a rigid body)", low=0.0, high=inf, open_low=True
        )
        ratio = checks.number("poissons_ratio", self.poissons_ratio, "in (-1, 0.5]", low=-1.0, high=0.5, open_low=True)
        object.__setattr__(self, "youngs_modulus", modulus)
        object.__setattr__(self, "poissons_ratio", ratio)
        if self.density is not None:
            object.__setattr__(self, "density", checks.positive("density", self.density))

    @classmethod
    def from_shear_modulus(
        cls, shear_modulus: float, poissons_ratio: float, density: float | None = None, name: str = "", source: str = ""
    ) -> Material:
        """The material with this shear modulus G [Pa]: E = 2 (1 + nu) G."""
        shear = checks.number("shear_modulus", shear_modulus, "> 0 (inf: a rigid body)", low=0, high=inf, open_low=True)
        ratio = checks.number("poissons_ratio", poissons_ratio, "in (-1, 0.5]", low=-1.0, high=0.5, open_low=True)
        return cls(2.0 * (1.0 + ratio) * shear, ratio, density, name, source)

    @property
    def shear_modulus(self) -> float:
        """G = E/(2 (1 + nu)) [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poissons_ratio))

    @property
    def is_rigid(self) -> bool:
        """Whether the material does not deform at all."""
        return isinf(self.youngs_modulus)

    @property
    def normal_compliance(self) -> float:
        """(1 - nu^2)/E [1/Pa], the body's part of 1/E*."""
        return (1.0 - self.poissons_ratio**2) / self.youngs_modulus

    @property
    def tangential_compliance(self) -> float:
        """(2 - nu)/(4 G) [1/Pa], the body's part of 1/G*."""
        return (2.0 - self.poissons_ratio) / (4.0 * self.shear_modulus)


RIGID = Material(inf, 0.5, name="rigid", source="no deformation: E infinite in both effective moduli")

_KHARAZ = "as used for Kharaz, Gorham & Salman, Powder Technol. 120 (2001) 281, by the Lethe and MFIX examples"

MATERIALS: dict[str, Material] = {
    material.name: material
    for material in (
        Material(
            2.034e11, 0.28, 7833.0, "steel",
            "E (29.5e6 psi) and rho (0.283 lb/in^3): suppliers' data for AISI 52100 ball steel; "
            "nu: Maw, Barber & Fawcett, J. Lubr. Technol. 103 (1981) 74, Fig. 1",
        ),
        Material(
            4.0e6, 0.5, 1100.0, "rubber",
            "nu: Maw, Barber & Fawcett (1981), Fig. 5; E and rho: within the 0.7 to 4.1 MPa and 960 to 1280 kg/m^3 "
            "tabulated for vulcanised rubber; grades differ widely, measure yours",
        ),
        Material(7.0e10, 0.25, 2500.0, "glass", f"soda-lime glass, {_KHARAZ}"),
        Material(
            7.0e10, 0.33, 2700.0, "aluminium",
            "aluminium alloy of the benchmarks of Chung & Ooi, Granul. Matter 13 (2011) 643, test 4, as in YADE",
        ),
        Material(3.8e11, 0.23, 4000.0, "alumina", f"aluminium oxide, {_KHARAZ}"),
        Material(
            6.3e11, 0.24, 15000.0, "tungsten carbide",
            "cemented tungsten carbide, MakeItFrom.com property sheet 'Tungsten Carbide (WC)'",
        ),
        Material(
            3.2e9, 0.28, 1319.0, "cellulose acetate",
            "rho: Foerster, Louge, Chang & Allia, Phys. Fluids 6 (1994) 1108 (Louge's impact chart); E and nu: "
            "attributed to Mullier, Tuzun & Walton, Powder Technol. 65 (1991) 61, not checked against the original; "
            "handbooks give E from 1 to 3 GPa",
        ),
        RIGID,
    )
}  # fmt: skip
"""Named materials; each carries the source of its numbers."""
