"""Whole studies of bridges of drawn diodes, next to ngspice: the same, refused, without a number, or different.

    python benchmarks/junctions.py [COUNT [FIRST]]

Each number is a diode, with a saturation current from 1e-18 to 1e-5 A, an emission coefficient from
0.5 to 3, and with or without Rs and Cjo, as a bridge on a plate under a harmonic excitation or
noise, and a study: `run --engine compiled`, `charge --engine slow` (a held storage capacitor),
`charge --engine compiled` (noise alone), or `node` (its first packet).  Under a harmonic excitation
the judge is ngspice alone (slow_circuits.py), which has the device as a mesh; under noise it is
engine `spice`.  A voltage to charge to is a share of what ngspice reaches, or under noise of what
the mean current reaches.  Two numbers are the same if they differ by less than the stated errors of
both, under noise by less than z = 4, or by `SAME` of the larger one.
"""

import collections
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from slow_circuits import ngspice_alone

import harvester as hv
from harvester.equations.problem import Problem
from harvester.storage.measured_current import measured
from harvester.uncertainty.value import stderr_of95

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.support.netlists import BRIDGE, written

STUDIES = [
    ("drive", "run"), ("drive", "charge by slow"), ("drive", "node"),
    ("noise", "run"), ("noise", "charge by slow"), ("noise", "charge by compiled"), ("noise", "node"),
]  # fmt: skip
STORES = {"run": ("0.47u", "200k"), "node": ("10u", "1T")}  # F and ohm; others as of CHARGED
CHARGED = ("10u", "1Meg")
SHAKING = {
    "drive": {"acceleration_amplitude": "0.3 g", "frequency": "46 Hz"},
    "noise": {"acceleration_psd": "2e-3 g^2/Hz"},
}
SECONDS, STEP, RELTOL = 1.5, 5e-5, 1e-4  # of ngspice alone
CONVERGING = "itl4=60 cshunt=1e-13"  # F at each node: ngspice gives up at some nodes without
SHARE = 0.7  # of the voltage that is reached, as a target
LOWEST = 5e-3  # V: what reaches no more has no target
RUNS = 6  # of ngspice under noise
SAME = 0.01
PACKET = {"currents": (1e-5,), "durations": (1e-3,), "interval": 5.0, "sleep_current": 1e-12}


def card(rng):
    """A diode's model as its text."""
    words = [f"Is={10.0 ** rng.uniform(-18.0, -5.0):.3g}", f"N={rng.uniform(0.5, 3.0):.3g}"]
    if rng.random() < 0.5:
        words.append(f"Rs={10.0 ** rng.uniform(-1.0, 3.0):.3g}")
    if rng.random() < 0.5:
        words.append(f"Cjo={10.0 ** rng.uniform(-12.0, -10.0):.3g}")
    return f".model d D({' '.join(words)})"


def scene_of(model, shaking, study, folder):
    """The plate with the bridge."""
    farads, ohm = STORES.get(study, CHARGED)
    body = BRIDGE.format("d") + f"Csmooth a b {farads}\nRload a b {ohm}\n{model}\n"
    return hv.Scene(
        oscillator=hv.Oscillator(mass="8 g", frequency="46 Hz", damping_ratio=0.03),
        piezo=hv.Piezo(coupling="1.5 mN/V", capacitance="47 nF"),
        excitation=hv.Excitation(**SHAKING[shaking]),
    ).with_load(netlist=written(Path(folder), body))


def judged_under_a_drive(scene, study):
    """What ngspice alone answers as a number without an error, and the target (V)."""
    problem = Problem.of(scene)
    t, store, energy = ngspice_alone(problem, SECONDS, STEP, RELTOL, CONVERGING)
    if study == "run":
        late = 0.75 * SECONDS
        power = (energy[-1] - np.interp(late, t, energy)) / (t[-1] - late)
        return hv.Value(float(power), bias=0.0), 0.0
    target = SHARE * float(store.max())
    passed = np.interp(target, np.maximum.accumulate(store), t)
    return hv.Value(float(passed), bias=0.0), target


def judged_under_noise(scene, study):
    """What engine spice answers, and the target (V), as far as the mean current flows freely."""
    if study == "run":
        return hv.run(scene, "spice", budget="20s").mean_power, 0.0
    table = measured(Problem.of(scene), runs=32).best
    target = float(np.interp(-SHARE * table.current[0], -table.current, table.voltages))
    if target < LOWEST:
        return None, target
    return hv.charge(scene, target, engine="spice", trajectories=RUNS, seed=1000).time, target


def answered(scene, study, target, farads):
    """The answer of the package's own engines."""
    if study == "run":
        return hv.run(scene, "compiled").mean_power
    if study == "node":
        node = hv.SensorNode(wake_voltage=target, stop_voltage=0.5 * target, **PACKET)
        whole = hv.Scene(
            oscillator=scene.oscillator,
            piezo=scene.piezo,
            excitation=scene.excitation,
            load=scene.load,
            storage=hv.Storage(capacitance=farads),
            node=node,
        )
        return hv.node(whole, days=60.0 / 86400.0).first_packet
    return hv.charge(scene, target, engine=study.split()[-1]).time


def verdict(found, judge):
    """The kind of a pair of values."""
    if found is None or judge is None:
        return "no number" if found is None else "no judge"
    change = abs(found.value - judge.value)
    errors = stderr_of95(found.known_error95), stderr_of95(judge.known_error95)
    enough = max(
        4.0 * np.hypot(*errors) if judge.stderr else found.known_error95,
        SAME * max(abs(found.value), abs(judge.value)),
    )
    return "same" if change <= enough else "DIFFERENT"


def main():
    """Print each study and the counts."""
    count, first = (int(one) for one in [*sys.argv[1:], "60", "0"][:2])
    counts = collections.Counter()
    for k in range(first, first + count):
        shaking, study = STUDIES[k % len(STUDIES)]
        model = card(np.random.default_rng(k))
        begin = time.process_time()
        found = judge = None
        target, why = 0.0, ""
        with tempfile.TemporaryDirectory() as folder:
            scene = scene_of(model, shaking, study, folder)
            try:
                judging = judged_under_a_drive if shaking == "drive" else judged_under_noise
                judge, target = judging(scene, study)
                if judge is not None and (target > LOWEST or study == "run"):
                    farads = STORES.get(study, CHARGED)[0]
                    found = answered(scene, study, target, farads.replace("u", " uF"))
                    kind = verdict(found, judge)
                else:
                    kind = "nothing to charge to"
            except (hv.HarvesterError, SystemExit) as error:
                kind, why = ("no judge" if judge is None else "refused"), str(error)[:300]
        counts[kind] += 1
        seconds = time.process_time() - begin
        numbers = f"{target:.3g} V", found, judge, kind, why, f"{seconds:.0f} s"
        print(k, shaking, study, model, *numbers, sep=" | ", flush=True)
    print(dict(counts))


if __name__ == "__main__":
    main()
