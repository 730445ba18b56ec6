"""Drawing of one path: over time, in the phase plane, and how it spends its time."""

from typing import TYPE_CHECKING

import numpy as np

from harvester.figures import new, png

if TYPE_CHECKING:
    from harvester.studies.motion import Motion

_INK, _PALE, _STOP = "#0072B2", "0.75", "#D55E00"
_MOST = 4000  # points of a line


def motion(found: "Motion", title: str) -> bytes:
    """Displacement and voltage of the part shown, phase plane and density of the whole path; stops in orange."""
    rows = 2 if found.acceleration is None else 3
    figure, axes = new(rows, 2, (10, 2.6 * rows), width_ratios=[2.2, 1])
    end = float(found.t[-1])
    last = found.t >= end - found.shown
    units = (("mm", 1e3), ("V", 1.0), ("m/s$^2$", 1.0), ("s", 1.0)) if found.physical else 4 * (("", 1.0),)
    (mm, millimetre), (volt, _), (ms2, _), (second, _) = units
    thin = slice(None, None, max(1, int(last.sum()) // _MOST))
    t, x, voltage = found.t[last][thin], millimetre * found.x[last][thin], found.voltage[last][thin]
    in_time = [(x, "displacement", mm), (voltage, "voltage", volt)]
    if found.acceleration is not None:
        in_time.append((found.acceleration[last][thin], "base acceleration", ms2))
    for row, (values, name, unit) in zip(axes[:, 0], in_time, strict=True):
        row.plot(t, values, color=_INK, linewidth=0.9)
        row.set_ylabel(_named(name, unit))
        row.set_xlim(end - found.shown, end)
        row.grid(color="0.92")
    axes[-1, 0].set_xlabel(_named("time", second))
    times = found.impacts[:, 0]
    hits = found.impacts[times >= end - found.shown]
    if 0 < len(hits) <= _MOST:
        places = np.where(hits[:, 1] > 0.0, found.stops[0], found.stops[-1])
        axes[0, 0].plot(hits[:, 0], millimetre * places, ".", color=_STOP, markersize=4)
    for stop in found.stops:
        axes[0, 0].axhline(millimetre * stop, color=_STOP, linewidth=1.0)
    settled = found.t >= 0.25 * end
    plane, density = axes[0, 1], axes[1, 1]
    some = slice(None, None, max(1, int(settled.sum()) // 20_000))
    plane.plot(millimetre * found.x[settled][some], millimetre * found.v[settled][some], ",", color=_PALE, zorder=1)
    few = found.t >= end - 0.15 * found.shown
    plane.plot(millimetre * found.x[few], millimetre * found.v[few], color=_INK, linewidth=0.8)
    plane.set_xlabel(_named("displacement", mm))
    plane.set_ylabel(_named("velocity", "mm/s" if found.physical else ""))
    density.hist(millimetre * found.x[settled], 80, density=True, color=_PALE)
    density.set_xlabel(_named("displacement", mm))
    density.set_ylabel(_named("density", f"1/{mm}" if mm else ""))
    for one in (plane, density):
        for stop in found.stops:
            one.axvline(millimetre * stop, color=_STOP, linewidth=1.0)
    if rows == 3:
        axes[2, 1].hist(found.voltage[settled], 80, density=True, color=_PALE)
        axes[2, 1].set_xlabel(_named("voltage", volt))
        axes[2, 1].set_ylabel(_named("density", f"1/{volt}" if volt else ""))
    told = " (orange: the stop, and impacts)" if found.stops else ""
    figure.suptitle((title or "One path") + told, fontsize=11, wrap=True, parse_math=False)
    return png(figure)


def _named(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit else name
