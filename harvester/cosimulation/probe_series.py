"""The readings of a circuit's probes in a finished run of ngspice: means over time, and values at given times."""

import math
from collections.abc import Sequence

import numpy as np

from harvester.arrays import Floats
from harvester.cosimulation.lockstep.drive import Drive
from harvester.cosimulation.lockstep.model_drive import ModelDrive
from harvester.cosimulation.lockstep.state import AFTER
from harvester.errors import CircuitError
from harvester.netlists.probes import Probe


def vectors_of(probes: Sequence[Probe]) -> tuple[str, ...]:
    """The vectors of ngspice that probes are made of, each once."""
    return tuple(dict.fromkeys(name for probe in probes for name in probe.vectors))


def values_of(probe: Probe, drive: Drive | ModelDrive) -> Floats:
    """A probe's values at the accepted points of a finished run, shape (n,), in its unit.

    Raises CircuitError if ngspice has no such quantity.
    """
    for name in probe.vectors:
        if len(drive.series[name]) != len(drive.series["time"]):
            raise CircuitError(
                f"ngspice must report {probe.name} of the circuit, but has no vector {name}"
            )
    return probe.values(drive.series)


def means_of_probes(probes: Sequence[Probe], drive: Drive) -> Floats:
    """Mean, mean square, least and largest of each probe after the burn-in: shape (probes, 4).

    Integrals over ngspice's accepted points by trapezoids, as those of the energy balance: between
    the same two points. Not a number if the run ended before.
    """
    s = drive.state[0]
    times = drive.series.get("time", np.empty(0))
    if s.measuring != AFTER or not probes:
        return np.full((len(probes), 4), math.nan)
    here = slice(
        np.searchsorted(times, s.begin * (1.0 - 1e-12)),
        np.searchsorted(times, s.end * (1.0 + 1e-12)),
    )
    t = times[here]
    rows = []
    for probe in probes:
        y = values_of(probe, drive)[here]
        means = [float(np.trapezoid(series, t)) / (t[-1] - t[0]) for series in (y, y * y)]
        rows.append([*means, float(y.min()), float(y.max())])
    return np.array(rows, dtype=np.float64)


def probes_at(probes: Sequence[Probe], drive: Drive, times: Floats) -> Floats:
    """The values of probes at ``times`` (s) within a finished run, shape (probes, len(times)).

    Between accepted points they are straight lines.
    """
    rows = [np.interp(times, drive.series["time"], values_of(probe, drive)) for probe in probes]
    return np.array(rows, dtype=np.float64).reshape(len(probes), len(times))
