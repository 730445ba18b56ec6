"""A cantilever of layers with a tip mass, as the modes of a scene: by Euler and Bernoulli's modes, mostly the first.

    EI phi'''' = w^2 m phi,   phi(0) = phi'(0) = 0,   EI phi''(L) = w^2 It phi'(L),   EI phi'''(L) = -w^2 Mt phi(L)
    1 = m int phi^2 dx + Mt phi(L)^2 + It phi'(L)^2,   sigma = m int phi dx + Mt phi(L)
    mass = sigma^2    stiffness = w^2 sigma^2    coupling = vartheta phi'(L) sigma    tip = phi(L) sigma X

For the mode j > 1, turned so that phi_j(L) >= 0 and with the mass of the first, all being of
phi_1(L) >= 0:

    base = sigma_j/sigma_1    coupling = vartheta phi_j'(L) sigma_1    at_stop = phi_j(L)/phi_1(L)

The strain is largest at the clamp, at the piezo's outer surface, c from the neutral axis: strain =
c phi''(0) sigma X. The mass is so chosen that the base acceleration needs no factor.  vartheta =
|e31| b z, with z from the neutral axis to the middle of the piezo, e31 = d31 Y; two layers in
series halve the sum of both, in parallel they add. Source: Erturk and Inman 2009, Smart Mater.
Struct. 18, 025009.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from harvester.devices import materials
from harvester.errors import InputError
from harvester.presentation.diagnostic import Diagnostic, note

TURN = 2.0 * math.pi
# just above the roots of a beam without a tip mass, which makes them smaller
BARE = (2.0, 4.8, 8.0, 11.1)
APPROXIMATIONS = (
    "a slender beam of one width, clamped stiffly, layers bonded without glue, electrodes over the whole length",
    "bending alone, without damping, which no geometry determines: --damping-ratio or --q, the same for all modes",
)


@dataclass(frozen=True)
class Beam:
    """A cantilever: lengths in m, tip mass in kg.

    ``layers`` of piezo is 1 or 2, ``parallel`` is how two are wired.

    ``tip_length`` along the beam and ``tip_height`` are of the tip mass, whose centre is assumed at
    the beam's end.
    """

    length: float
    width: float
    substrate_thickness: float
    piezo_thickness: float
    piezo: str
    substrate: str
    layers: int
    parallel: bool = False
    tip_mass: float = 0.0
    tip_length: float = 0.0
    tip_height: float = 0.0


@dataclass(frozen=True)
class Lumped:
    """The scene's values of a beam in SI units, and the ratios of tip and piezo to the scene's displacement.

    ``tip`` is the tip's displacement over it, ``strain`` the largest strain of the piezo over it
    (1/m). ``higher_modes`` are those above the first, whose masses are ``mass``.
    """

    mass: float
    stiffness: float
    coupling: float
    capacitance: float
    tip: float
    strain: float
    higher_modes: tuple["BeamMode", ...] = ()


class BeamMode(NamedTuple):
    """A mode above the first: frequency in short circuit (Hz), and coupling, base and at_stop as of a scene's mode."""

    frequency: float
    coupling: float
    base: float
    at_stop: float


class Bending(NamedTuple):
    """A mode of unit modal mass: its root k = beta L, w^2, sigma, and the slope and displacement (> 0) of the tip."""

    root: float
    w2: float
    sigma: float
    slope: float
    tip: float
    norm: float


def lumped(beam: Beam, modes: int = 1) -> Lumped:
    """The values of a beam with so many modes.

    Raises InputError for materials that are not known.
    """
    ceramic, plate = materials.piezo(beam.piezo), materials.substrate(beam.substrate)
    b = beam.width
    hs = beam.substrate_thickness
    hp = beam.piezo_thickness
    length = beam.length
    two = beam.layers == 2
    m = b * (plate.density * hs + beam.layers * ceramic.density * hp)
    # The neutral axis from the middle of the substrate: moved by one layer, not by two.
    middle = 0.5 * (hs + hp)
    axis = 0.0 if two else ceramic.young * hp * middle / (plate.young * hs + ceramic.young * hp)
    z = middle - axis
    stiffness = plate.young * (hs**3 / 12.0 + hs * axis**2) + beam.layers * ceramic.young * (
        hp**3 / 12.0 + hp * z**2
    )
    bending = b * stiffness
    bendings = _bendings(beam, m, bending, modes)
    vartheta = abs(ceramic.d31) * ceramic.young * b * z
    capacitance = ceramic.permittivity * b * length / hp
    if two:
        vartheta, capacitance = (
            (2.0 * vartheta, 2.0 * capacitance) if beam.parallel else (vartheta, 0.5 * capacitance)
        )
    first = bendings[0]
    sigma = first.sigma
    surface = 0.5 * hs + hp - axis
    # the shape's curvature: -2 (k/L)^2
    strain = surface * 2.0 * (first.root / length) ** 2 * first.norm * sigma
    higher_modes = tuple(
        BeamMode(
            math.sqrt(mode.w2) / TURN,
            vartheta * mode.slope * sigma,
            mode.sigma / sigma,
            mode.tip / first.tip,
        )
        for mode in bendings[1:]
    )
    coupling = vartheta * first.slope * sigma
    return Lumped(
        mass=sigma**2,
        stiffness=first.w2 * sigma**2,
        coupling=coupling,
        capacitance=capacitance,
        tip=first.tip * sigma,
        strain=abs(strain),
        higher_modes=higher_modes,
    )


def _bendings(beam: Beam, m: float, bending: float, count: int) -> list[Bending]:
    """The first modes of a beam of mass m a length and bending stiffness EI."""
    from scipy.integrate import quad
    from scipy.optimize import brentq

    length = beam.length
    tip = beam.tip_mass / (m * length)
    turning = beam.tip_mass * (beam.tip_length**2 + beam.tip_height**2) / 12.0
    inertia = turning / (m * length**3)

    def ends(k: float) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
        """Moment and shear at the end for cos - cosh and sin - sinh, without the factor of both."""
        c = math.cos(k)
        s = math.sin(k)
        ch = math.cosh(k)
        sh = math.sinh(k)
        moment = [-(c + ch) + inertia * k**3 * (s + sh), -(s + sh) - inertia * k**3 * (c - ch)]
        shear = [s - sh + tip * k * (c - ch), -(c + ch) + tip * k * (s - sh)]
        return np.array([moment, shear])

    def determinant(k: float) -> float:
        return float(np.linalg.det(ends(k)))

    def bent(k: float) -> Bending:
        ratio = float(-ends(k)[0][0] / ends(k)[0][1])

        def shape(u: float) -> float:
            return math.cos(k * u) - math.cosh(k * u) + ratio * (math.sin(k * u) - math.sinh(k * u))

        slope = k / length * (-math.sin(k) - math.sinh(k) + ratio * (math.cos(k) - math.cosh(k)))
        square = length * quad(lambda u: shape(u) ** 2, 0.0, 1.0)[0]
        norm = 1.0 / math.sqrt(m * square + beam.tip_mass * shape(1.0) ** 2 + turning * slope**2)
        sigma = m * length * quad(shape, 0.0, 1.0)[0] + beam.tip_mass * shape(1.0)
        norm = math.copysign(norm, shape(1.0))
        w2 = k**4 * bending / (m * length**4)
        return Bending(k, w2, norm * sigma, norm * slope, norm * shape(1.0), norm)

    grid = np.linspace(1e-3, BARE[count - 1], 400 * count)
    signs = np.sign([determinant(k) for k in grid])
    sign_changes = np.flatnonzero(signs[1:] != signs[:-1])[:count]
    return [
        bent(float(brentq(determinant, grid[at], grid[at + 1], xtol=1e-14))) for at in sign_changes
    ]


def remarks_on(beam: Beam, lumped_mode: Lumped, has_lifetime: bool) -> list[Diagnostic]:
    """The parameters from a geometry, the constants used, and the assumptions.

    ``has_lifetime`` states whether `harvester run --lifetime` supports the scene.
    """
    peak = ": harvester run --lifetime '5 years' has the peak" if has_lifetime else ""
    ceramic, plate = materials.piezo(beam.piezo), materials.substrate(beam.substrate)
    wired = ("parallel" if beam.parallel else "series") if beam.layers == 2 else "one layer"
    block = (
        " and of its block's turning"
        if beam.tip_length or beam.tip_height
        else ", a point at the end"
    )
    block = block if beam.tip_mass else ""
    piezo: dict[str, Any] = {
        "name": beam.piezo,
        "young": ceramic.young / 1e9,
        "d31": ceramic.d31 * 1e12,
    }
    piezo |= {
        "permittivity": ceramic.permittivity / materials.EPSILON_0,
        "density": ceramic.density,
    }
    substrate: dict[str, Any] = {
        "name": beam.substrate,
        "young": plate.young / 1e9,
        "density": plate.density,
    }
    return [
        note("geometry_mode", "geometry", wired=wired, tip=lumped_mode.tip, block=block),
        note("geometry_strain", "geometry", strain=1e3 * lumped_mode.strain, lifetime=peak),
        note("geometry_piezo", "geometry", source=ceramic.source, **piezo),
        note("geometry_substrate", "geometry", source=plate.source, **substrate),
        *(note("geometry_assumed", "geometry", what=assumption) for assumption in APPROXIMATIONS),
    ]


def check_alone(known: dict[str, str]) -> None:
    """Refuse values of a datasheet that the geometry gives, with an InputError."""
    for name in (
        "mass",
        "stiffness",
        "frequency",
        "coupling",
        "open_circuit_frequency",
        "capacitance",
    ):
        if name in known:
            raise InputError(
                f"`{name}` must be left out if the geometry gives it, but both are given"
            )
