"""Whether the power of a periodic response lies within its stated error: random linear circuits, and rectifier bridges.

A linear circuit is a ladder of resistors, capacitors and coils behind the piezo of a random device,
shaken near its resonance or off it.  Its power is known in closed form, for at the frequency w the
phasors of x, V and the nodes obey

    (m (w0^2 - w^2 + 2 i zeta w0 w)) x + theta V = m a,   Y(w) V = i w theta x,

where Y is the admittance of the piezo's capacitance beside that of the ladder, by nodal analysis.
A bridge of diodes has no such form; its answer at a tenth of the relative error stands for the
truth, with its own error.

    python benchmarks/periodic_errors.py                 # all: 200 ladders by each engine, and 50 bridges
    python benchmarks/periodic_errors.py spice 20        # so many ladders by one engine; nothing is kept
    python benchmarks/periodic_errors.py bridges 10      # so many bridges; nothing is kept
"""

import math
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from common import report

import harvester as hv

LADDERS, BRIDGES = 200, 50
WITHIN = 1e-3  # relative error that is asked for: of bridges, and a tenth of it of their truth
G = 9.80665


@dataclass(frozen=True)
class Device:
    """A mass on a spring with a piezo, and what shakes it; SI units."""

    mass: float
    natural: float
    zeta: float
    coupling: float
    capacitance: float
    acceleration: float
    frequency: float

    @classmethod
    def random(cls, rng):
        """A device with a coupling k^2 of 1e-3 to 0.3, near its resonance in two cases of three."""
        mass, natural = log_uniform(rng, 1e-3, 0.05), log_uniform(rng, 15.0, 250.0)
        zeta, capacitance = log_uniform(rng, 3e-3, 0.05), log_uniform(rng, 5e-9, 200e-9)
        squared = log_uniform(rng, 1e-3, 0.3)
        stiffness = mass * (2.0 * math.pi * natural) ** 2
        near = rng.random() < 2.0 / 3.0
        ratio = (
            rng.uniform(0.97, 1.0 + 0.6 * squared + 0.03) if near else log_uniform(rng, 0.6, 1.6)
        )
        coupling = math.sqrt(squared * stiffness * capacitance)
        given = (
            mass,
            natural,
            zeta,
            coupling,
            capacitance,
            G * log_uniform(rng, 0.05, 1.0),
            natural * ratio,
        )
        return cls(*(float(f"{number:.4g}") for number in given))

    def scene(self, path, load, store=None):
        """The scene with the netlist of a file, whose load is the resistor of this name."""
        return hv.Scene(
            oscillator=hv.Oscillator(
                mass=self.mass, frequency=self.natural, damping_ratio=self.zeta
            ),
            piezo=hv.Piezo(coupling=self.coupling, capacitance=self.capacitance),
            excitation=hv.Excitation(
                acceleration_amplitude=self.acceleration, frequency=self.frequency
            ),
            load=hv.Load(netlist=str(path), terminals=["PZ1", "PZ2"], resistor=load, store=store),
        )

    def voltage(self, admittance):
        """The phasor of the piezo's voltage on a circuit of that admittance at the drive's frequency."""
        w, w0 = 2.0 * math.pi * self.frequency, 2.0 * math.pi * self.natural
        whole = admittance + 1j * w * self.capacitance
        impedance = (
            self.mass * (w0**2 - w**2 + 2j * self.zeta * w0 * w) + 1j * w * self.coupling**2 / whole
        )
        return 1j * w * self.coupling * self.mass * self.acceleration / impedance / whole


def log_uniform(rng, low, high):
    """A number between two, on a logarithmic scale."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def ladder(rng, device, coils=True):
    """Elements (name, node, node, value) of a random ladder behind PZ1 and PZ2; the load is RL at its end."""
    w = 2.0 * math.pi * device.frequency
    size = 1.0 / (w * device.capacitance)
    node = "PZ1"
    elements = []
    for k in range(int(rng.integers(0, 4))):
        for place in ("series", "across"):
            kind = str(rng.choice(["R", "C", "L"] if coils else ["R", "C"]))
            ohms = size * (
                log_uniform(rng, 0.01, 1.0) if place == "series" else log_uniform(rng, 0.3, 30.0)
            )
            there = f"N{k}" if place == "series" else "PZ2"
            if kind == "L":  # with the resistance of its wire
                middle = f"M{k}{place[0]}"
                wire = float(f"{ohms * log_uniform(rng, 0.02, 0.3):.4g}")
                elements.append((f"RW{k}{place[0]}", node, middle, wire))
                elements.append((f"L{k}{place[0]}", middle, there, float(f"{ohms / w:.4g}")))
            else:
                value = ohms if kind == "R" else 1.0 / (w * ohms)
                elements.append((f"{kind}{k}{place[0]}", node, there, float(f"{value:.4g}")))
            node = there if place == "series" else node
    return [*elements, ("RL", node, "PZ2", float(f"{size * log_uniform(rng, 0.1, 10.0):.4g}"))]


def netlist(elements):
    """The text of a flat netlist of these elements."""
    return (
        "\n".join(
            ["* a ladder", *(f"{name} {a} {b} {value!r}" for name, a, b, value in elements), ".end"]
        )
        + "\n"
    )


def closed_form(device, elements):
    """The mean power of RL (W)."""
    w = 2.0 * math.pi * device.frequency
    nodes = sorted({node for _, a, b, _ in elements for node in (a, b)} - {"PZ2", "PZ1"})
    at = {name: k for k, name in enumerate(["PZ1", *nodes])}
    admittances = np.zeros((len(at), len(at)), dtype=complex)
    for name, a, b, value in elements:
        y = {"R": 1.0 / value, "C": 1j * w * value, "L": 1.0 / (1j * w * value)}[name[0]]
        ends = [at[node] for node in (a, b) if node in at]
        for i in ends:
            for j in ends:
                admittances[i, j] += y if i == j else -y
    unit = np.zeros(len(at), dtype=complex)
    unit[0] = 1.0
    across = np.linalg.solve(admittances, unit)  # voltages where 1 A flows in
    voltage = device.voltage(1.0 / across[0])
    _, a, b, ohms = elements[-1]
    difference = sum(sign * across[at[node]] for sign, node in ((1.0, a), (-1.0, b)) if node in at)
    return abs(voltage * difference / across[0]) ** 2 / 2.0 / ohms


def bridge(rng, device):
    """The text of a bridge of four diodes, with a capacitor and a load of random sizes."""
    w = 2.0 * math.pi * device.frequency
    ohms = log_uniform(rng, 0.3, 10.0) / (w * device.capacitance)
    periods = log_uniform(rng, 2.0, 200.0)  # that the store lasts
    farads = periods / device.frequency / ohms
    junction = float(f"{log_uniform(rng, 2e-12, 40e-12):.3g}")
    model = f"D(Is={log_uniform(rng, 1e-9, 3e-6):.3g} N={rng.uniform(1.0, 1.9):.3g} "
    model += f"Rs={log_uniform(rng, 0.1, 20.0):.3g}"
    pairs = ("PZ1", "OUT"), ("PZ2", "OUT"), ("0", "PZ1"), ("0", "PZ2")
    diodes = [f"D{k} {a} {b} DSK" for k, (a, b) in enumerate(pairs, 1)]
    store = [f"C1 OUT 0 {farads:.4g}", f"R1 OUT 0 {ohms:.4g}"]
    return (
        "\n".join(["* a bridge", *diodes, *store, f".model DSK {model} Cjo={junction!r})", ".end"])
        + "\n"
    )


def row_of(name, answer, truth, other=0.0, seconds=0.0):
    """What a power is off by, with its stated error and that of the truth."""
    stated = answer.mean_power.known_error95
    off = answer.mean_power.value - truth
    known = not answer.mean_power.unknown
    off = float(off)
    periodic = any(one.code == "comes_back" for one in answer.diagnostics)
    ratio = float(abs(off) / math.hypot(stated, other)) if stated else math.inf
    relative = {"off": float(off / truth), "stated": float(stated / truth), "ratio": ratio}
    return {"case": name, **relative, "known": known, "periodic": periodic, "seconds": seconds}


def ladders(engine, count, folder, coils=True):
    """A row for each random ladder by one engine."""
    rows = []
    for seed in range(count):
        rng = np.random.default_rng([seed, 1])
        device = Device.random(rng)
        elements = ladder(rng, device, coils)
        path = Path(folder) / f"ladder{seed}.cir"
        path.write_text(netlist(elements))
        begin = time.perf_counter()
        try:
            answer = engine.run(device.scene(path, "RL"))
        except hv.HarvesterError as error:
            rows.append(
                {
                    "case": f"{engine.NAME} ladder {seed}",
                    "error": f"{type(error).__name__}: {error}",
                }
            )
        else:
            seconds = time.perf_counter() - begin
            row = row_of(
                f"{engine.NAME} ladder {seed}",
                answer,
                closed_form(device, elements),
                seconds=seconds,
            )
            rows.append(row | {"kinds": "".join(sorted({name[0] for name, *_ in elements}))})
        show(rows[-1])
    return rows


def bridges(count, folder):
    """A row for each random bridge by engine `spice`, beside itself at a tenth of the relative error."""
    rows = []
    for seed in range(count):
        rng = np.random.default_rng([seed, 2])
        device = Device.random(rng)
        path = Path(folder) / f"bridge{seed}.cir"
        path.write_text(bridge(rng, device))
        scene = device.scene(path, "R1", "C1")
        begin = time.perf_counter()
        try:
            answer = hv.Spice(within=WITHIN).run(scene)
            seconds = time.perf_counter() - begin
            truth = hv.Spice(within=WITHIN / 10.0).run(scene).mean_power
        except hv.HarvesterError as error:
            rows.append({"case": f"bridge {seed}", "error": f"{type(error).__name__}: {error}"})
        else:
            rows.append(row_of(f"bridge {seed}", answer, truth.value, truth.known_error95, seconds))
        show(rows[-1])
    return rows


def show(row):
    """Print a row as soon as it is there."""
    cells = (
        f"{key} {value:.3g}" if isinstance(value, float) else f"{key} {value}"
        for key, value in row.items()
    )
    print("  ".join(cells), flush=True)


def summary(name, rows):
    """How many of the rows are outside their stated error, and by how much at most."""
    told = [row for row in rows if "error" not in row and row["known"]]
    worst = max((row["ratio"] for row in told), default=math.nan)
    outside = sum(bool(row["ratio"] > 1.0) for row in told)
    refused = sum("error" in row for row in rows)
    unknown = len(rows) - len(told) - refused
    seconds = float(np.median([row["seconds"] for row in told])) if told else math.nan
    stated = float(np.median([row["stated"] for row in told])) if told else math.nan
    counts = {
        "cases": len(rows),
        "outside": outside,
        "of unknown error": unknown,
        "refused": refused,
    }
    return {
        "name": name,
        **counts,
        "largest ratio": worst,
        "median stated": stated,
        "median seconds": seconds,
    }


def main():
    """Run what the command line asks for."""
    which = sys.argv[1] if len(sys.argv) > 1 else "all"
    count = int(sys.argv[2]) if len(sys.argv) > 2 else None
    engines = {"spice": hv.Spice(), "compiled": hv.Compiled()}
    sums = []
    with tempfile.TemporaryDirectory() as folder:
        for name, engine in engines.items():
            if which in (name, "all"):
                new = ladders(engine, count or LADDERS, folder)
                sums.append(summary(f"{name}, ladders", new))
        if which in ("bridges", "all"):
            new = bridges(count or BRIDGES, folder)
            sums.append(summary("spice, bridges", new))
    if which == "all":
        report("periodic_errors", sums)
    else:
        for one in sums:
            show(one)


if __name__ == "__main__":
    main()
