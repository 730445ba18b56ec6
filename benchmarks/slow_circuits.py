"""Engine `slow` and slow charges beside ngspice alone, which has the device as a mesh of its own elements.

    python benchmarks/slow_circuits.py SCENE.toml SECONDS [STEP [RELTOL]]

prints the mean power of the load over the second half of the time, the voltages of the store with
the times at which it reached them, and what `slow` says.  Minutes of ngspice; results and versions
are kept in tests/engines/test_slow.py.
"""

import re
import subprocess
import sys

import numpy as np

import harvester as hv
from harvester.equations.problem import Problem
from harvester.netlists.part import by_name

DECK = """whole device
Vbase b0 0 SIN(0 {force!r} {f!r} 0 0 90)
Lmass b0 b1 {M!r}
Rdamping b1 b2 {c!r}
Cspring b2 b3 {compliance!r}
Etransformer b3 b4 p 0 {theta!r}
Vspeed b4 0 0
Ftransformer 0 p Vspeed {theta!r}
Cp p 0 {Cp!r}
Bint 0 eint I=1e-3*(v({load_plus})-v({load_minus}))^2/{ohm!r}
Cint eint 0 1e-3
Rint eint 0 1e15
{text}
.options method=gear maxord=2 reltol={reltol} interp {more}
.control
set width=250
set nobreak
save time v({plus}) v({minus}) v(eint)
tran 1e-3 {end!r} 0 {step!r} uic
print col time v({plus})-v({minus}) v(eint)
.endc
.end
"""


def ngspice_alone(problem, seconds, step, reltol, more=""):
    """Times (s), the store's voltage, and the energy that the load has taken (J), with ``more`` options."""
    device = problem.scene.modal
    shaking = problem.scene.excitation
    load = problem.circuit
    plus, minus = load.smoothing_nodes
    resistor = by_name(load.parts)["rload"]
    load_plus, load_minus = resistor.nodes
    deck = DECK.format(
        force=device.mass * shaking.acceleration_amplitude,
        f=shaking.frequency,
        M=device.mass,
        c=device.damping,
        compliance=1.0 / device.stiffness,
        theta=device.coupling,
        Cp=device.capacitance,
        text=load.text,
        reltol=reltol,
        plus=plus,
        load_plus=load_plus,
        load_minus=load_minus,
        ohm=resistor.effective_value,
        minus=minus,
        end=seconds,
        step=step,
        more=more,
    )
    done = subprocess.run(
        ["ngspice", "-b", "/dev/stdin"], input=deck, capture_output=True, text=True, check=False
    )
    rows = [row.split()[1:] for row in done.stdout.splitlines() if re.match(r"\d+\t", row)]
    t, store, energy = np.array(rows, dtype=float).T
    if t[-1] < 0.999 * seconds:
        raise SystemExit(f"ngspice stopped at {t[-1]} s: {done.stderr[-300:]}")
    return t, store, energy


def main():
    scene = sys.argv[1]
    seconds = float(sys.argv[2])
    step, reltol = (float(one) for one in [*sys.argv[3:], "1e-4", "1e-4"][:2])
    problem = Problem.of(scene)
    t, store, energy = ngspice_alone(problem, seconds, step, reltol)
    half = 0.5 * seconds
    power = (energy[-1] - np.interp(half, t, energy)) / (t[-1] - half)
    print(
        f"ngspice alone, step {step:g} s, reltol {reltol:g}: {power:.5g} W from {half:g} s to {seconds:g} s"
    )
    for volts in (1.0, 2.0, 3.0, 5.0, 10.0, 15.0, 20.0):
        if store.max() >= volts:
            print(
                f"store at {volts:g} V after {np.interp(volts, np.maximum.accumulate(store), t):.5g} s"
            )
    print(
        hv.run(scene, "slow")
        if hv.Slow.refusal(problem) is None
        else hv.charge(scene, to=store.max(), engine="slow")
    )


if __name__ == "__main__":
    main()
