"""The diode's equations: ngspice's own currents, and charges whose derivatives are the capacitances."""

import re
import subprocess

import numpy as np
import pytest

from harvester.circuits.junctions import THERMAL, breakdown_voltage, depletion, diode

VOLTAGES = [-31.0, -30.2, -29.0, -5.0, -0.2, -0.05, 0.1, 0.3, 0.5]


@pytest.mark.ngspice
def test_the_current_of_a_diode_is_that_of_ngspice(tmp_path):
    sources = [f"V{k} a{k} 0 {v}\nD{k} a{k} 0 d" for k, v in enumerate(VOLTAGES)]
    deck = [
        "* diodes",
        *sources,
        ".model d D(Is=0.1u N=1.2 Cjo=12p M=0.3 Bv=30 Ibv=20u)",
        ".options reltol=1e-6",
    ]
    prints = [f"print i(V{k})" for k in range(len(VOLTAGES))]
    path = tmp_path / "deck.cir"
    path.write_text(
        "\n".join([*deck, ".control", "set numdgt=12", "op", *prints, ".endc", ".end"]) + "\n"
    )
    out = subprocess.run(
        ["ngspice", "-b", str(path)], capture_output=True, text=True, check=False
    ).stdout
    currents = [-float(value) for value in re.findall(r"i\(v\d+\) = (\S+)", out, re.IGNORECASE)]
    n = 1.2 * THERMAL
    b = breakdown_voltage(0.1e-6, n, 30.0, 20e-6)
    ours = [diode(v, 0.1e-6, n, b, n, 0.0, 1.0, 0.5, 0.5, 0.0)[0] + 1e-12 * v for v in VOLTAGES]
    assert currents == pytest.approx(ours, rel=2e-5)


@pytest.mark.parametrize("v", [-4.0, -0.1, 0.2, 0.49, 0.51, 0.9])
def test_charges_are_the_integrals_of_capacitances(v):
    given = 12e-12, 1.0, 0.3, 0.5
    up, down = depletion(v + 1e-6, *given)[0], depletion(v - 1e-6, *given)[0]
    assert (up - down) / 2e-6 == pytest.approx(depletion(v, *given)[1], rel=1e-6)
    device = 2.5e-9, 0.045, 100.0, 0.045, *given, 20e-9
    up, down = (diode(v + step, *device) for step in (1e-7, -1e-7))
    i, g, _, c = diode(v, *device)
    assert (up[0] - down[0]) / 2e-7 == pytest.approx(g, rel=1e-4, abs=1e-16)
    assert (up[2] - down[2]) / 2e-7 == pytest.approx(c, rel=1e-4)
    assert np.sign(i) == np.sign(v)
