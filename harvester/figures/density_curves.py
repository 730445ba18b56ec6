"""The figures of densities, with the histogram of one trajectory behind them, and of a spectrum."""

from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.figures.motions import bins, time_spent
from harvester.figures.quantities import scale
from harvester.figures.style import WIDTH, entitle, legend, new
from harvester.presentation.plot import Plot, styled
from harvester.studies.stationary_densities import Densities

_INK, _PALE = "#661100", "0.8"
_LEAST = 1e-5  # of the peak: where a density ends on the picture


def densities(result: Densities, title: str | None) -> Plot:
    """Draw the densities of displacement and voltage, alone and together, impact speeds and the voltage's spectrum."""
    u, path = result.unit_names, result.path
    settled = path.time >= 0.25 * path.time[-1]
    impacts = path.impacts[path.impacts[:, 0] >= 0.25 * path.time[-1]]
    panels = 3 + sum(
        part is not None for part in (result.voltage_plane, result.impact_speed, result.spectrum)
    )
    rows = -(-panels // 2)
    with styled():
        figure, grid = new(rows, 2, (WIDTH, 0.6 + 2.4 * rows))
        panels_left = iter(grid.ravel())
        curve = next(panels_left)
        _curve(curve, "displacement", u.length, result.displacement, result.displacement_density)
        _histogram(
            curve, path.displacement[settled], scale("", u.length, result.displacement).factor
        )
        curve = next(panels_left)
        _curve(curve, "voltage", u.voltage, result.voltage, result.voltage_density)
        _histogram(curve, path.voltage[settled], scale("", u.voltage, result.voltage).factor)
        x, v = result.displacement[::4], result.velocity[::4]
        _plane(
            next(panels_left),
            result.phase_plane,
            ("displacement", u.length, x),
            ("velocity", u.speed, v),
        )
        if result.voltage_plane is not None:
            axes = (
                ("displacement", u.length, result.plane_displacement),
                ("voltage", u.voltage, result.plane_voltage),
            )
            _plane(next(panels_left), result.voltage_plane, *axes)
        if result.impact_speed is not None and result.impact_density is not None:
            curve = next(panels_left)
            rate = float(np.trapezoid(result.impact_density, result.impact_speed))
            _curve(
                curve, "impact speed", u.speed, result.impact_speed, result.impact_density / rate
            )
            if len(impacts) > 1:
                factor = scale("", u.speed, result.impact_speed).factor
                counts, edges = np.histogram(np.abs(impacts[:, 1]) / factor, bins=40, density=True)
                curve.stairs(counts, edges, fill=True, color=_PALE, zorder=0)
        if result.frequency is not None and result.spectrum is not None:
            curve = next(panels_left)
            curve.loglog(result.frequency, result.spectrum, color=_INK, linewidth=1.2)
            for axis in (curve.xaxis, curve.yaxis):
                axis.set_major_formatter(lambda number, _: f"{number:g}")
                axis.set_minor_formatter("")
            curve.set_xlabel(f"frequency ({u.frequency or 'of the resonance'})")
            curve.set_ylabel(f"voltage density ({'V²/Hz' if u.frequency else 'nondimensional'})")
        for unused in panels_left:
            unused.remove()
        entitle(figure, title, "How is the motion distributed?")
        how = "Lines and velocity over displacement: engine density. Grey bars"
        counted = " and voltage over displacement" if result.voltage_plane is not None else ""
        legend(figure, f"{how}{counted}: counted along one sampled trajectory.")
    return figure


def _curve(here: Any, name: str, unit: str, at: Floats, density: Floats) -> None:
    """Draw a density if it is not all but 0."""
    of = scale(name, unit, at)
    shown = density > _LEAST * density.max()
    here.plot(
        at[shown] / of.factor, density[shown] * of.factor, color=_INK, linewidth=1.2, zorder=2
    )
    here.set_xlabel(of.label)
    inside = of.label[of.label.rindex("(") + 1 : -1]
    unit = f"1/({inside})" if "/" in inside else f"1/{inside}"
    here.set_ylabel(f"density ({'nondimensional' if 'nondimensional' in inside else unit})")


def _histogram(here: Any, values: Floats, factor: float) -> None:
    """Draw how long a path spends at each value, behind the curve."""
    edges = bins(values / factor)
    here.stairs(time_spent(values / factor, edges), edges, fill=True, color=_PALE, zorder=0)


def _plane(here: Any, density: Floats, *axes: tuple[str, str, Any]) -> None:
    """Draw the density of two quantities as colours."""
    of_x, of_y = (scale(name, unit, values) for name, unit, values in axes)
    x, y = axes[0][2] / of_x.factor, axes[1][2] / of_y.factor
    here.pcolormesh(
        x, y, np.maximum(density, 0.0).T, cmap="viridis", rasterized=True, shading="nearest"
    )
    here.grid(visible=False)
    here.set_xlabel(of_x.label)
    here.set_ylabel(of_y.label)
