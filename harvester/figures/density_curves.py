"""The figure of the densities of a motion, with the histogram of one path behind them, and of a spectrum."""

from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.figures.motions import bins, time_spent
from harvester.figures.quantities import scale
from harvester.figures.shapes import DensitiesShape
from harvester.figures.style import WIDTH, Plot, entitle, legend, new, styled

_INK, _PALE = "#661100", "0.8"
_LEAST = 1e-5  # of the peak: where a density ends on the picture


def densities(found: DensitiesShape, title: str | None) -> Plot:
    """Draw the densities of displacement and voltage, the phase plane, and impact speeds or the voltage's spectrum."""
    u, path = found.unit_names, found.path
    settled = path.time >= 0.25 * path.time[-1]
    impacts = path.impacts[path.impacts[:, 0] >= 0.25 * path.time[-1]]
    further = [one is not None for one in (found.impact_speed, found.spectrum)]
    with styled():
        figure, grid = new(2 + all(further), 2, (WIDTH, 5.4 + 2.4 * all(further)))
        places = iter(grid.ravel())
        curve = next(places)
        _curve(curve, "displacement", u.length, found.displacement, found.displacement_density)
        _histogram(curve, path.displacement[settled], scale("", u.length, found.displacement).factor)
        curve = next(places)
        _curve(curve, "voltage", u.voltage, found.voltage, found.voltage_density)
        _histogram(curve, path.voltage[settled], scale("", u.voltage, found.voltage).factor)
        _plane(next(places), found)
        if found.impact_speed is not None and found.impact_density is not None:
            curve, rate = next(places), float(np.trapezoid(found.impact_density, found.impact_speed))
            _curve(curve, "impact speed", u.speed, found.impact_speed, found.impact_density / rate)
            if len(impacts) > 1:
                factor = scale("", u.speed, found.impact_speed).factor
                counts, edges = np.histogram(np.abs(impacts[:, 1]) / factor, bins=40, density=True)
                curve.stairs(counts, edges, fill=True, color=_PALE, zorder=0)
        if found.frequency is not None and found.spectrum is not None:
            curve = next(places)
            curve.loglog(found.frequency, found.spectrum, color=_INK, linewidth=1.2)
            for axis in (curve.xaxis, curve.yaxis):
                axis.set_major_formatter(lambda tick, _: f"{tick:g}")
                axis.set_minor_formatter("")
            curve.set_xlabel(f"frequency ({u.frequency or 'of the resonance'})")
            curve.set_ylabel(f"voltage density ({'V²/Hz' if u.frequency else 'nondimensional'})")
        for unused in places:
            unused.remove()
        entitle(figure, title, "How is the motion distributed?")
        legend(figure, "Lines: the density itself, without sampling. Grey: one path.")
    return figure


def _curve(here: Any, name: str, unit: str, at: Floats, density: Floats) -> None:
    """Draw a density where it is not all but 0."""
    of = scale(name, unit, at)
    shown = density > _LEAST * density.max()
    here.plot(at[shown] / of.factor, density[shown] * of.factor, color=_INK, linewidth=1.2, zorder=2)
    here.set_xlabel(of.label)
    inside = of.label[of.label.rindex("(") + 1 : -1]
    unit = f"1/({inside})" if "/" in inside else f"1/{inside}"
    here.set_ylabel(f"density ({'nondimensional' if 'nondimensional' in inside else unit})")


def _histogram(here: Any, values: Floats, factor: float) -> None:
    """Draw how long a path spends at each value, behind the curve."""
    edges = bins(values / factor)
    here.stairs(time_spent(values / factor, edges), edges, fill=True, color=_PALE, zorder=0)


def _plane(here: Any, found: DensitiesShape) -> None:
    """Draw the density of displacement and velocity as colours."""
    u = found.unit_names
    of_x, of_v = scale("displacement", u.length, found.displacement), scale("velocity", u.speed, found.velocity)
    x, v = found.displacement[::4] / of_x.factor, found.velocity[::4] / of_v.factor
    here.pcolormesh(x, v, np.maximum(found.phase_plane, 0.0).T, cmap="viridis", rasterized=True, shading="nearest")
    here.grid(visible=False)
    here.set_xlabel(of_x.label)
    here.set_ylabel(of_v.label)
