"""Materials of beams by name, with the source of their constants."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

from harvester.errors import unknown

_T = TypeVar("_T")
EPSILON_0 = 8.8541878128e-12  # F/m
_BOOK = "Erturk and Inman, Piezoelectric Energy Harvesting, Wiley 2011, appendix E; eps_S = eps_T - d31^2 Y"
_MEASURED = "Erturk and Inman 2009, Smart Mater. Struct. 18, 025009 (PSI-5A4E on brass)"


@dataclass(frozen=True)
class Piezoceramic:
    """A piezoelectric layer: Young's modulus at constant field (Pa), kg/m^3, d31 (m/V), clamped permittivity (F/m)."""

    young: float
    density: float
    d31: float
    permittivity: float
    source: str


@dataclass(frozen=True)
class Substrate:
    """A layer without piezoelectricity: Young's modulus (Pa), density (kg/m^3)."""

    young: float
    density: float
    source: str


PIEZOS = {
    "PZT-5A": Piezoceramic(66e9, 7800.0, -190e-12, 1500.0 * EPSILON_0, _MEASURED),
    "PZT-5H": Piezoceramic(
        1.0 / 16.5e-12, 7500.0, -274e-12, 3400.0 * EPSILON_0 - 274e-12**2 / 16.5e-12, _BOOK
    ),
    "PVDF": Piezoceramic(
        3e9,
        1780.0,
        23e-12,
        12.0 * EPSILON_0 - 23e-12**2 * 3e9,
        "Piezo Film Sensors, Technical Manual",
    ),
}
SUBSTRATES = {
    "steel": Substrate(200e9, 7850.0, "a handbook's value of structural steel"),
    "brass": Substrate(105e9, 9000.0, _MEASURED),
    "aluminium": Substrate(70e9, 2700.0, "a handbook's value"),
    "FR4": Substrate(22e9, 1850.0, "a typical value of laminates' datasheets"),
    "silicon": Substrate(
        169e9, 2330.0, "Hopcroft, Nix and Kenny 2010, J. MEMS 19, 229: along <110>"
    ),
}


def piezo(name: str) -> Piezoceramic:
    """The piezoelectric material of a name, in any case.

    InputError with the nearest match for another.
    """
    return _named("material of `piezo`", name, PIEZOS)


def substrate(name: str) -> Substrate:
    """The material of the substrate of a name, in any case.

    InputError with the nearest match for another.
    """
    return _named("material of `substrate`", name, SUBSTRATES)


def _named(what: str, name: str, known: Mapping[str, _T]) -> _T:
    for known_name, material in known.items():
        if known_name.lower() == name.strip().lower():
            return material
    raise unknown(what, name, known)
