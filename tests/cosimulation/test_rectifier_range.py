"""Load circuits far from where they are at home: voltages, loads, capacitors, couplings and time constants.

Voc is the RMS of the open-circuit voltage theta x/Cp of the uncoupled device.
"""

import math
import re

import numpy as np
import pytest

from harvester.cosimulation import runs as worker
from harvester.equations.coefficients import Equations
from harvester.equations.scales import Scales
from harvester.errors import CircuitError
from harvester.mechanics.kernels.noise import gaussian_grid
from harvester.mechanics.trace import trace
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from tests.support.systems import changed

pytestmark = pytest.mark.ngspice

# the diodes are 1N4148, at 27 degrees Celsius
CP = 50.2e-9
W0 = 20.0
IS = 2.52e-9
N = 1.752
THERMAL = 0.0258649
RECTIFIERS = ("bridge", "doubler", "parallel_sshi", "series_sshi", "sece")
FREE = Equations(beta=0.05, c1=-0.05, n1=0.05)  # E[x^2] = 1 if the voltage is small
STOP = changed(FREE, restitution=0.96)
SEED = np.random.SeedSequence(3)
PLACE = re.compile(r"trouble with|\bat (node|an unnamed node|the piezo|the current)")


def device(eqs, volts, load, h=0.1, stride=1):
    theta = 1e-3
    mass = theta**2 / (eqs.beta * W0**2 * CP)
    scales = Scales(
        mass=mass, frequency=W0, length=volts * CP / theta, coupling=theta, capacitance=CP
    )
    return worker.CoupledDevice(eqs, scales, load_circuit(load, CP), h, stride)


def rectifier(name, resistance=1e6, smoothing=1e-7):
    return Load(netlist=name, parameters={"R": resistance, "C": smoothing, "Bv": 1e5})


def measured(dev, kicks=600):
    """From rest: mean power of Rload, and mean power that the mass gives to the circuit, in watt."""
    one = next(worker.measure_in_workers(dev, [SEED], n_steps=kicks, burn_in=0.0))
    taken = dev.eqs.beta * float(one.moments.vV.mean()) * dev.scales.watts
    load = float(one.load_power[0])
    assert np.isfinite([load, taken]).all()
    return load, taken


def deviation(path, exact):
    return float(np.sqrt(np.mean((path.V - exact.V) ** 2) / np.mean(exact.V**2)))


LOADS, CAPACITORS = (1.0, 1e4, 1e9), (1e-9, 1e-6, 1.0)
# Each circuit meets every load and every capacitor, and each pair of them one or two circuits
PAIRS = [
    (n, load, CAPACITORS[(i + k) % 3])
    for k, n in enumerate(RECTIFIERS)
    for i, load in enumerate(LOADS)
]


@pytest.mark.thorough("test_voltage_of_the_load")
@pytest.mark.parametrize("name, resistance, smoothing", PAIRS)
def test_any_load_and_capacitor(name, resistance, smoothing):
    """A load of 1 ohm to 1 Gohm and a capacitor of 1 nF to 1 F: the load gets no more than the mass gives, or a
    named error states where the circuit is in trouble.
    """
    try:
        power, taken = measured(device(STOP, 20.0, rectifier(name, resistance, smoothing)))
    except CircuitError as error:
        assert PLACE.search(str(error))
        return
    assert 0.0 < power < 1.02 * taken


@pytest.mark.thorough("test_bridge_from_square_law_to_ideal")
@pytest.mark.parametrize("volts", [0.1, 0.3, 0.8])
@pytest.mark.parametrize("name", RECTIFIERS)
def test_knee_of_the_diode(name, volts):
    """Voc of 0.1 to 0.8 V, where the diodes hardly conduct: the load gets no more than the mass gives."""
    power, taken = measured(device(STOP, volts, rectifier(name)))
    assert 0.0 <= power < 1.02 * taken


def test_bridge_from_square_law_to_ideal():
    """P/Voc^4 is constant far below N kT/e = 45 mV, to 2 % up to 16 mV; P/Voc^2 grows to a constant above 100 V."""
    low = {
        v: measured(device(FREE, v, rectifier("bridge", 18e6, 1e-8)), 2000)[0]
        for v in (0.001, 0.004, 0.016)
    }
    assert low[0.004] / low[0.001] == pytest.approx(4.0**4, rel=2e-3)
    assert low[0.016] / low[0.004] == pytest.approx(4.0**4, rel=0.02)
    shares = [
        measured(device(FREE, v, rectifier("bridge")), 2000)[0] / v**2
        for v in (0.1, 0.3, 0.8, 3.0, 100.0, 1e3)
    ]
    assert (np.diff(shares) > 0.0).all()
    assert shares[-1] == pytest.approx(shares[-2], rel=0.02)


@pytest.mark.parametrize("volts", [1e-9, 1e-6, 1e-4])
def test_bridge_of_a_small_signal_is_a_resistor(volts):
    """Four diodes of N kT/(e Is) = 18 Mohm in balance: V' = x' - mu V with that resistance, to 5e-4."""
    noise = gaussian_grid(SEED, 1000)
    path = worker.path_in_worker(device(FREE, volts, rectifier("bridge")), noise)
    mu = IS / (N * THERMAL * CP * W0)
    assert deviation(path, trace(changed(FREE, mu=mu), noise, 0.1)) < 5e-4


@pytest.mark.thorough("test_bridge_from_square_law_to_ideal")
@pytest.mark.parametrize("mu", [0.05, 1.0, 30.0])
def test_resistor_from_nanovolts_to_kilovolts(mu):
    """The nondimensional path does not depend on the signal's level: to 1e-9 from 1 nV to 1 kV, impacts included."""
    noise = gaussian_grid(SEED, 1000)
    eqs = changed(STOP, mu=mu)
    load = Load(resistance=1.0 / (mu * CP * W0))
    paths = [
        worker.path_in_worker(device(eqs, volts, load), noise) for volts in (1.0, 1e-9, 1e-6, 1e3)
    ]
    for path in paths[1:]:
        assert deviation(path, paths[0]) < 1e-9


def test_a_netlist_from_nanovolts_to_kilovolts(tmp_path):
    """Steps of ngspice's own: two resistors at mu = 30 give the same nondimensional path from 1 nV to 1 kV."""
    half = 0.5 / (30.0 * CP * W0)
    text = f"* two\n.subckt two p n\nR1 p a {half!r}\nRload a n {half!r}\n.ends\n"
    (tmp_path / "two.cir").write_text(text)
    load = Load(netlist=str(tmp_path / "two.cir"))
    noise = gaussian_grid(SEED, 1000)
    paths = [
        worker.path_in_worker(device(FREE, volts, load), noise) for volts in (1.0, 1e-9, 1e-6, 1e3)
    ]
    for path in paths[1:]:
        assert deviation(path, paths[0]) < 1e-6


@pytest.mark.thorough("test_ledger_closes_within_a_percent")
@pytest.mark.parametrize("beta, name", [(1.2, "sece"), *((10.0, name) for name in RECTIFIERS)])
def test_strong_coupling_of_rectifiers(beta, name):
    """beta of 1.2 and 10, with the stop: the load gets no more than the mass gives, and that about N1 at most."""
    eqs = changed(STOP, beta=beta)
    dev = device(eqs, 20.0, rectifier(name), 0.1 / math.sqrt(1.0 + beta))
    power, taken = measured(dev, 1500)
    assert 0.0 < power < 1.02 * taken < 2.0 * eqs.n1 * dev.scales.watts


@pytest.mark.thorough("test_bridge_from_square_law_to_ideal")
@pytest.mark.parametrize("mu", [0.01, 1.0, 100.0])
@pytest.mark.parametrize("beta", [1.2, 10.0])
def test_strong_coupling_with_a_stop(beta, mu):
    """beta of 1.2 and 10, mu of 0.01 to 100, with impacts: the path of the exact update until impacts part them."""
    noise = gaussian_grid(SEED, 400)
    h = 0.1 / math.sqrt(1.0 + beta)
    eqs = changed(STOP, beta=beta, mu=mu)
    path = worker.path_in_worker(device(eqs, 20.0, Load(resistance=1.0 / (mu * CP * W0)), h), noise)
    exact = trace(eqs, noise, h)
    assert len(exact.impacts) > 1
    assert deviation(path, exact) < (1e-3 if mu <= 1.0 else 0.03)
