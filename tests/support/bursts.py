"""Records of bursts, as on a machine that starts or a truck that passes; a node's packets on them without a mean."""

import dataclasses
import math

import numpy as np

import harvester as hv
from harvester.equations.problem import Problem
from harvester.mechanics.kernels.forcing import forcing
from harvester.records.profiles.standard_curves import CURVES, G
from harvester.storage.measured_current import Rectifier
from harvester.storage.rectifier_cut import STORE
from tests.support.paths import EXAMPLES

SCENE = hv.load(EXAMPLES / "bimorph_packets.toml")
RATE = 500.0  # samples per second


def on_record(folder, times, values):
    """The scene on a record (m/s^2), without its clamp."""
    path = folder / "record.csv"
    rows = [f"{t:.4f},{a:.6f}" for t, a in zip(times, values, strict=True)]
    path.write_text("\n".join(["time (s),acceleration (m/s^2)", *rows, ""]))
    return dataclasses.replace(SCENE, excitation=hv.Excitation(acceleration_file=str(path)))


def tone(t):
    """A tone of 1.5 m/s^2 at 46 Hz."""
    return 1.5 * np.sin(2 * math.pi * 46.0 * t)


def truck(t):
    """Cargo on a truck up to half the rate (MIL-STD-810, vertical) at 0.3 of its level, which repeats."""
    frequencies = np.fft.rfftfreq(len(t), 1.0 / RATE)
    hertz, density = np.array(CURVES["mil-std-810-truck-vertical"].points).T
    some = np.clip(frequencies, hertz[0], hertz[-1])
    level = (
        G**2
        * 10.0 ** np.interp(np.log10(some), np.log10(hertz), np.log10(density))
        * (frequencies == some)
    )
    rng = np.random.default_rng(4)
    return 0.3 * np.fft.irfft(
        np.sqrt(level * RATE * len(t) / 2.0) * np.exp(2j * math.pi * rng.random(len(level))), len(t)
    )


def bursts(seconds, every, burst=20.0, of=tone):
    """Times (s) and accelerations (m/s^2) of what lasts for ``burst`` in every ``every`` seconds, in a little noise."""
    t = np.arange(int(seconds * RATE)) / RATE
    return t, of(t) * (t % every < burst) + 0.05 * np.random.default_rng(3).standard_normal(len(t))


def packets_directly(scene, seconds, slice_=0.1):
    """Packets of a node by the mass with the netlist's own elements and its own store, which each packet lowers.

    A packet draws its energy at once; sleep and leakage draw theirs in each slice of time.
    """
    storage, node = scene.storage, scene.node
    problem = Problem.of(dataclasses.replace(scene, storage=None, node=None))
    scales, eqs = problem.scales, problem.equations
    circuit = Rectifier(problem).compiled(storage.farads)
    at = circuit.charge_at(STORE)
    h = 0.1
    kicks = round(slice_ * scales.frequency / h)
    h = slice_ * scales.frequency / kicks
    shaking = forcing(eqs, h, kicks * round(seconds / slice_))
    packet = (
        sum(amperes * length for amperes, length in node.states)
        * node.supply_voltage
        / node.efficiency
    )
    state = circuit.rest
    start = (0.0, 0.0)
    on = False
    due = 0.0
    sent = 0
    for k in range(round(seconds / slice_)):
        part = shaking[k * kicks : (k + 1) * kicks + 1]
        path = circuit.trace(eqs, np.zeros(kicks), h, kicks, start, state, part)
        x, _, _, v, _ = map(float, path.samples[-1])
        state = path.state
        start = (x, v + 0.5 * h * float(part[-1]))
        volts = state[at] / storage.farads
        volts -= slice_ * volts / storage.leakage_resistance / storage.farads
        if on:
            volts -= (
                slice_
                * node.sleep_current
                * node.supply_voltage
                / node.efficiency
                / volts
                / storage.farads
            )
        now = (k + 1) * slice_
        if not on and volts >= node.wake_voltage:
            on = True
            due = now
        if on and now >= due:
            left = volts**2 - 2.0 * packet / storage.farads
            on = left > node.stop_voltage**2
            sent = sent + on
            due = due + node.interval
            volts = math.sqrt(max(left, node.stop_voltage**2))
        on = on and volts > node.stop_voltage
        state[at] = min(volts, storage.clamp_voltage) * storage.farads
    return sent
