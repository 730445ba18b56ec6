"""Measured piezoelectric cantilevers by their inputs (benchmarks/cantilevers.csv), and the lumped mode of a geometry.

The numbers of D10 to D24 are taken from quotations of the papers in an open compilation of papers of the field, the
public dataset VEHBench, and not from the papers themselves; the DOI of each is in the table.  A row has dimensions,
materials, tip mass, measured resonance, acceleration, load, the origin of each number, and the names of what the
source leaves open.  A cell with ``|`` has alternatives of equal weight, and ``;`` separates layers.

The mode is that of the load on the tip (on a bare beam: of a uniform load), after Rayleigh, for any layers and a
patch on a part of the length; on a bare beam its coupling is 4 % below that of the exact mode.  With the displacement
phi, which is 1 at the mass, M = Mt + int m phi^2 dx and G = Mt + int m phi dx:

    mass = G^2/M    stiffness = mass w^2    coupling = e31 b z (phi'(x2) - phi'(x1)) G/M    tip = G/M

Materials: those of `harvester.devices.materials`, and below those that it lacks, with their sources.
"""

import csv
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harvester.devices import materials
from harvester.devices.materials import EPSILON_0, Piezoceramic, Substrate

HERE = Path(__file__).parent
TURN = 2.0 * math.pi
POINTS = 201
_REVIEW = "|e31,f| 8 to 12 C/m^2, permittivity 300 to 1300 (Trolier-McKinstry and Muralt 2004, J. Electroceram. 12, 7)"
_MANUAL = "Piezo Film Sensors, Technical Manual"


def film(
    young: float, density: float, e31: float, permittivity: float, source: str
) -> Piezoceramic:
    """A layer by its |e31| (C/m^2) and its relative permittivity."""
    return Piezoceramic(young, density, -e31 / young, permittivity * EPSILON_0, source)


PIEZOS = materials.PIEZOS | {
    "PZT film": film(70e9, 7600.0, 10.0, 620.0, f"{_REVIEW}; the geometric middle"),
    "epitaxial PZT film": film(80e9, 7600.0, 10.0, 300.0, f"{_REVIEW}; the lowest permittivity"),
    "KNN film": film(90e9, 4500.0, 8.0, 700.0, "a judgement: films of KNN are near those of PZT"),
    "PZT by aerosol deposition": film(
        90.75e9, 7500.0, 1.6, 205.0, "constants of D6, a film of the same kind: Sensors 2021, 21, 4747"
    ),
    "P(VDF-TrFE)": Piezoceramic(3e9, 1820.0, 11e-12, 7.9 * EPSILON_0, f"{_MANUAL}, copolymer"),
    "crystal composite": film(
        20e9, 6500.0, 15.0, 2500.0, "a judgement: fibres of a crystal, with more strain and less stiffness than PZT-5A"
    ),
}  # fmt: skip
_HANDBOOK = "a handbook's value"
SUBSTRATES = materials.SUBSTRATES | {
    "phosphor bronze": Substrate(110e9, 8800.0, _HANDBOOK),
    "beryllium bronze": Substrate(130e9, 8300.0, _HANDBOOK),
    "titanium": Substrate(110e9, 4430.0, f"{_HANDBOOK} of Ti-6Al-4V"),
    "mesh": Substrate(1e9, 600.0, "a judgement: a polymer of which a third is left"),
    "none": Substrate(1e9, 1000.0, "no layer: its thickness is 0"),
}


def table() -> dict[str, dict[str, str]]:
    """The rows of benchmarks/cantilevers.csv by device."""
    with (HERE / "cantilevers.csv").open(newline="") as file:
        return {row["device"]: row for row in csv.DictReader(file)}


@dataclass(frozen=True)
class Layer:
    """A layer of a section: Young's modulus (Pa), density (kg/m^3), thickness and width (m); ``piezo`` or None."""

    young: float
    density: float
    thickness: float
    width: float
    piezo: Piezoceramic | None = None


@dataclass(frozen=True)
class Section:
    """Bending stiffness (N m^2), mass per length (kg/m), and e31 b z (N m/V) of each piezoelectric layer."""

    bending: float
    mass: float
    moments: tuple[float, ...]


def section(layers: tuple[Layer, ...]) -> Section:
    """The section of layers, the lowest first, about their neutral axis."""
    stiff = np.array([layer.young * layer.thickness * layer.width for layer in layers])
    thick = np.array([layer.thickness for layer in layers])
    middles = np.cumsum(thick) - 0.5 * thick
    off = middles - float(stiff @ middles / stiff.sum())
    moments = [
        abs(layer.piezo.d31) * layer.piezo.young * layer.width * abs(float(z))
        for layer, z in zip(layers, off, strict=True)
        if layer.piezo is not None
    ]
    mass = sum(layer.density * layer.thickness * layer.width for layer in layers)
    return Section(float(stiff @ (thick**2 / 12.0 + off**2)), mass, tuple(moments))


@dataclass(frozen=True)
class Cantilever:
    """A cantilever in SI units; its patch reaches from ``begin`` to ``end``, its mass is ``reach`` beyond the beam."""

    length: float
    with_piezo: Section
    bare: Section
    begin: float
    end: float
    reach: float
    has_tip: bool
    capacitances: tuple[float, ...]


@dataclass(frozen=True)
class Mode:
    """Stiffness at the mass (N/m), int m phi dx and int m phi^2 dx (kg), and theta of each layer (N/V), all of phi."""

    stiffness: float
    first: float
    second: float
    couplings: tuple[float, ...]


def mode(beam: Cantilever) -> Mode:
    """The mode of the load on the mass, or of a uniform load without a mass."""
    x = np.linspace(0.0, beam.length, POINTS)
    middle = 0.5 * (x[1:] + x[:-1])
    step = x[1] - x[0]
    on = np.clip((np.minimum(beam.end, x[1:]) - np.maximum(beam.begin, x[:-1])) / step, 0.0, 1.0)
    patched, bare = beam.with_piezo, beam.bare
    compliance = on / patched.bending + (1.0 - on) / bare.bending
    arm = beam.length + beam.reach - middle
    moment = arm if beam.has_tip else 0.5 * arm**2
    curvature = moment * compliance
    slope = np.concatenate([[0.0], np.cumsum(curvature) * step])
    mid_slope = 0.5 * (slope[1:] + slope[:-1])
    deflection = np.concatenate([[0.0], np.cumsum(mid_slope) * step])
    size = float(deflection[-1] + beam.reach * slope[-1])
    phi = 0.5 * (deflection[1:] + deflection[:-1]) / size
    mass = (on * patched.mass + (1.0 - on) * bare.mass) * step
    bent = float(moment @ curvature) * step / size**2
    turn = float(np.interp(beam.end, x, slope) - np.interp(beam.begin, x, slope)) / size
    return Mode(
        stiffness=bent,
        first=float(mass @ phi),
        second=float(mass @ phi**2),
        couplings=tuple(one * turn for one in patched.moments),
    )


def wired(
    couplings: tuple[float, ...], capacitances: tuple[float, ...], parallel: bool
) -> tuple[float, float]:
    """Coupling and capacitance of layers in parallel, or in series: 1/C = sum 1/Ci, theta = C sum thetai/Ci."""
    if parallel:
        return sum(couplings), sum(capacitances)
    whole = 1.0 / sum(1.0 / one for one in capacitances)
    return whole * sum(a / b for a, b in zip(couplings, capacitances, strict=True)), whole


def picked(cell: str, uniform: float) -> str:
    """One of a cell's alternatives, of equal weight."""
    parts = cell.split("|")
    return parts[min(int(uniform * len(parts)), len(parts) - 1)]


def built(row: Mapping[str, str], of: Mapping[str, float]) -> Cantilever:
    """The cantilever of a row; ``of`` has uniform numbers for what is open.

    A block within the length makes its part rigid, one beyond it is carried by the end; half of the devices have
    either.  A half-length that is not stated is up to a sixth of the beam, and beyond the end of an etched device,
    whose block is a part of the wafer, up to a half.
    """
    sides = [1e-3 * float(row[name]) for name in ("length_mm", "width_mm")]
    swapped = "swap" in row["open"] and of["swap"] < 0.5
    length, width = reversed(sides) if swapped else sides
    reach = 0.0
    free = length
    if row["block"] != "none":
        inside = of["block"] < 0.5
        most = length / (2.0 if row["block"] == "etched" and not inside else 6.0)
        reach = 5e-4 * float(row["block_mm"]) if row["block_mm"] else most * of["reach"]
        free = length - 2.0 * reach if inside else length
    active = [1e-3 * float(part) for part in row["active_mm"].split("x") if part]
    patch_length, patch_width = active or (length, width)
    begin = 4e-3 * of["begin"] if "begin" in row["open"] else 0.0
    ceramic = PIEZOS[picked(row["piezo"], of["piezo"])]
    plate = SUBSTRATES[row["substrate"]]
    texts = picked(row["piezo_um"], of["piezo_um"]).split(";")
    thick = [1e-6 * float(text) for text in texts]
    if row["layers"] == "2" and len(thick) == 1:
        thick = thick * 2
    core = Layer(plate.young, plate.density, 1e-6 * float(row["substrate_um"]), width)
    piezos = [Layer(ceramic.young, ceramic.density, t, patch_width, ceramic) for t in thick]
    return Cantilever(
        length=free,
        with_piezo=section((*piezos[1:], core, piezos[0])),
        bare=section((core,)) if active else section((*piezos[1:], core, piezos[0])),
        begin=begin,
        end=min(begin + patch_length, free),
        reach=reach,
        has_tip=row["block"] != "none",
        capacitances=tuple(ceramic.permittivity * patch_length * patch_width / t for t in thick),
    )
