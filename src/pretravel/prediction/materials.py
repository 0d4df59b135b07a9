"""Linear elastic materials by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from pretravel.base import DescriptionError, TomlDocument, TomlStructure, parse_toml

STIFFEST = 1.5e6
"""Largest Young's modulus; that of diamond is 1.2e6. [MPa]"""
DENSEST = 2.5e-5
"""Largest density; that of osmium is 2.26e-5. [kg/mm³]"""
HARDEST = 1.5e5
"""Largest hardness; that of diamond is 1e5. [MPa]"""


@dataclass(frozen=True)
class Material:
    """An isotropic linear elastic material.

    Parameters
    ----------
    name : str
    youngs_modulus : float
        [MPa]
    poissons_ratio : float
    density : float
        [kg/mm³]
    source : str
        Where the numbers come from.
    hardness : float, optional
        By Vickers, as a pressure: 1000 HV are 9807 MPa. It is the limit of contacts. [MPa]

    >>> material("ceramic").youngs_modulus
    413000.0
    """

    name: str
    youngs_modulus: float
    poissons_ratio: float
    density: float
    source: str = ""
    hardness: float | None = None

    def __post_init__(self) -> None:
        self._check("Young's modulus", self.youngs_modulus, "MPa", STIFFEST)
        if not -1.0 < self.poissons_ratio < 0.5:
            raise DescriptionError(
                f"material '{self.name}': Poisson's ratio {self.poissons_ratio} "
                "must lie between -1 and 0.5"
            )
        self._check("density", self.density, "kg/mm³", DENSEST)
        if self.hardness is not None:
            self._check("hardness", self.hardness, "MPa", HARDEST)

    def _check(self, what: str, value: float, unit: str, largest: float) -> None:
        if not value > 0.0:
            raise DescriptionError(
                f"material '{self.name}': {what} {value:g} {unit} must be positive"
            )
        if not value <= largest:
            raise DescriptionError(
                f"material '{self.name}': {what} {value:g} {unit} is more than that of any "
                f"material ({largest:g} {unit}). Check the unit in the name of the key"
            )

    @property
    def shear_modulus(self) -> float:
        """E / (2 (1 + nu)). [MPa]"""
        return self.youngs_modulus / (2.0 * (1.0 + self.poissons_ratio))

    @property
    def shear_at_yield(self) -> float | None:
        """Shear stress at which it yields: half of the hardness over 2.8 (Tresca, Tabor). [MPa]"""
        return None if self.hardness is None else self.hardness / 5.6

    @property
    def plane_strain_compliance(self) -> float:
        """(1 - nu²) / E, one body's part of a contact modulus. [1/MPa]"""
        return (1.0 - self.poissons_ratio**2) / self.youngs_modulus

    def contact_modulus(self, second: Material) -> float:
        r"""E* = [(1 - nu1²)/E1 + (1 - nu2²)/E2]^-1. [MPa]

        >>> from pretravel.prediction.materials import material
        >>> round(material("ruby").contact_modulus(material("steel")))
        150987
        """
        return 1.0 / (self.plane_strain_compliance + second.plane_strain_compliance)


@dataclass(frozen=True)
class MaterialTable:
    """The keys of a material in a file."""

    youngs_modulus: float
    poissons_ratio: float
    density: float
    source: str = ""
    hardness: float | None = None


_STRUCTURE = TomlStructure()


def state_keys(structure: TomlStructure) -> None:
    """State the keys of tables of materials in a kind of file."""
    structure.table(
        MaterialTable,
        youngs_modulus="youngs_modulus_GPa",
        density="density_g_cm3",
        hardness="hardness_GPa",
    )


state_keys(_STRUCTURE)


def material_in(document: TomlDocument, name: str, *place: str | int) -> Material:
    r"""A material from its table at `place` in a document; the keys state the units.

    >>> text = "youngs_modulus_GPa = 70\npoissons_ratio = 0.33\ndensity_g_cm3 = 2.7"
    >>> material_in(parse_toml(text), "aluminium").youngs_modulus
    70000.0
    """
    table = _STRUCTURE.make(document, MaterialTable, *place)
    with document.located(*place):
        return Material(
            name,
            table.youngs_modulus,
            table.poissons_ratio,
            table.density,
            table.source,
            table.hardness,
        )


@cache
def known_materials() -> Mapping[str, Material]:
    """The materials that come with the package, by name.

    >>> "tungsten carbide" in known_materials()
    True
    """
    text = files("pretravel.prediction").joinpath("data/materials.toml").read_text(encoding="utf-8")
    document = parse_toml(text, "materials")
    return {name: material_in(document, name, name) for name in document.tables}


def material(name: str, others: Mapping[str, Material] | None = None) -> Material:
    """A material by name.

    Parameters
    ----------
    name : str
    others : mapping of str to Material, optional
        Materials of a description; they have precedence.

    Raises
    ------
    DescriptionError
        No such material; the message lists the known ones.

    >>> material("cheese")
    Traceback (most recent call last):
    ...
    pretravel.base.errors.DescriptionError: material 'cheese' is not known; known are aluminium, \
carbon fibre, cast iron, ceramic, copper, granite, ruby, silicon nitride, stainless steel, \
steel, titanium, tungsten carbide, zirconia. Add a [materials.'cheese'] table with \
youngs_modulus_GPa, poissons_ratio and density_g_cm3 to use another.
    """
    known = {**known_materials(), **(others or {})}
    if name not in known:
        raise DescriptionError(
            f"material '{name}' is not known; known are {', '.join(sorted(known))}. "
            f"Add a [materials.'{name}'] table with youngs_modulus_GPa, poissons_ratio "
            "and density_g_cm3 to use another."
        )
    return known[name]


def default_workpiece() -> Material:
    """The material of the workpiece when none is given: steel.

    >>> default_workpiece().name
    'steel'
    """
    return material("steel")
