"""The exported part with a load circuit in plain ngspice, and the same scene in lock-step, both from rest."""

import re
import subprocess

import numpy as np

import harvester as hv
from harvester.devices.export import part
from harvester.equations.problem import Problem
from tests.support.bimorph import bimorph

STOP = '[stop]\nrestitution = 0.9\ngap = "0.1 mm"'
STEP = "0.05 ms"  # of ours
# name: (the scene's text, nodes of the circuit between which the voltage is compared, seconds,
# longest step of ngspice)
CASES = {
    "bridge": (bimorph('R = "100 kohm", C = "1 uF"'), ("a", "b"), 0.3, 5e-5),
    "bridge and stop": (bimorph('R = "100 kohm", C = "1 uF"', stop=STOP), ("a", "b"), 0.2, 2e-6),
    "chip": (
        bimorph('R = "10 kohm", C = "2.2 uF", Cout = "1 uF"', netlist="ltc3588"),
        ("store", "com"),
        0.3,
        5e-5,
    ),
}


def both(name):
    """Times, and at them the voltage between the two nodes, of shape (n,) each: in plain ngspice, and by ours."""
    text, (plus, minus), end, step = CASES[name]
    one = hv.loads(text)
    problem = Problem.of(one)
    circuit = problem.circuit
    exported = part(problem, "device")
    options = re.search(r"^\*   (\.options .*)$", exported, re.MULTILINE)[1]
    if name == "chip":  # as the file states for a circuit that switches
        options = options.replace("reltol=1e-5", "reltol=1e-4")
    lines = ["bench", exported, circuit.text, "Xbase acc device_base", "Xdevice p 0 acc x device"]
    lines += [options, f".save v(p) v(xload.{plus}) v(xload.{minus})"]
    lines += [
        f".tran {max(step, 5e-5)} {end} 0 {step} uic",
        ".control",
        "set nobreak",
        "set width=150",
        "run",
    ]
    lines += ["linearize v(p) " + f"v(xload.{plus}) v(xload.{minus})"]
    lines += [f"print col time v(p) v(xload.{plus})-v(xload.{minus})", ".endc", ".end"]
    done = subprocess.run(
        ["ngspice", "-b", "/dev/stdin"],
        input="\n".join(lines),
        capture_output=True,
        text=True,
        check=False,
        timeout=90,
    )
    rows = np.array(
        [row.split()[1:] for row in done.stdout.splitlines() if re.match(r"\d+\t", row)],
        dtype=float,
    )
    assert len(rows), done.stdout[-2000:] + done.stderr[-2000:]
    probe = f"v({plus},{minus})"
    ours = hv.charge(one, "1000 V", probe=probe, duration=end, dt=STEP)
    inside = ours.t <= rows[-1, 0]
    t = ours.t[inside]
    return t, np.interp(t, rows[:, 0], rows[:, 2]), ours.voltage[inside]
