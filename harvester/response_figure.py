"""Drawing of a frequency response."""

from typing import TYPE_CHECKING

from harvester.figures import new, png

if TYPE_CHECKING:
    from harvester.response_table import Response

_LOOKS = {"up": {"color": "#0072B2", "marker": ">"}, "down": {"color": "#D55E00", "marker": "<", "linestyle": "--"}}


def response(found: "Response", title: str) -> bytes:
    """Power and RMS voltage against the frequency, up and down; the half-power bandwidth of each is a bar."""
    figure, (top, low) = new(2, 1, (7, 6.4), sharex=True)
    for direction, look in _LOOKS.items():
        points = found.sweep(direction)
        f = [p.frequency for p in points]
        for axes, values in ((top, [p.mean_power for p in points]), (low, [p.voltage_rms for p in points])):
            error = [v.error95 for v in values]
            axes.errorbar(f, [v.value for v in values], error, markersize=3, linewidth=1, label=direction, **look)
        low_edge, high_edge = found.edges(direction) or (None, None)
        if low_edge is not None:
            half = 0.5 * found.peak(direction).mean_power.value
            top.plot([low_edge, high_edge], [half, half], color=look["color"], linewidth=2.5, alpha=0.4)
    top.set_ylabel("mean power (W)" if found.physical else "mean power (nondimensional)")
    low.set_ylabel("RMS voltage (V)" if found.physical else "RMS voltage (nondimensional)")
    low.set_xlabel("drive frequency (Hz)" if found.physical else "drive frequency Omega")
    top.set_title(title or "Frequency response", wrap=True, parse_math=False)
    top.legend(frameon=False, fontsize=9)
    for axes in (top, low):
        axes.grid(color="0.92")
        axes.set_ylim(0.0, None)
    return png(figure)
