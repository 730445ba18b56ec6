"""The energy ledger closes: input = damping + impacts + circuit + load + stored."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from harvester.cosimulation import runs as worker
from harvester.cosimulation.lockstep.energy_ledger import (
    add_works_of_kick,
    ledger_of,
    note_stored_energy,
    stored_in_mass,
)
from harvester.cosimulation.lockstep.state import BEFORE, DURING, Point
from harvester.cosimulation.worker_pool import map_in_workers
from harvester.equations.coefficients import Equations
from harvester.mechanics.kernels.coefficients import Coefficients, State
from harvester.mechanics.kernels.compiled import interpreted
from harvester.mechanics.kernels.equation_of_motion import kick
from harvester.mechanics.kernels.noise import gaussian_grid
from harvester.mechanics.kernels.stored_energy import contact_energy
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.load import Load
from tests.support.lockstep import charging_curve, scales
from tests.support.systems import PAPER, changed

pytestmark = pytest.mark.ngspice

CP = 50.2e-9


def finished(device, noise, discard):
    """State, Csmooth and ledger of a run (in a worker)."""
    drive = worker.run_in_this_process(device, worker.new_drive(device, noise, discard))
    s = drive.state[0]
    state = {name: s[name].item() for name in s.dtype.names}
    return state, drive.smoothing, ledger_of(s, device.scales, drive.smoothing, device.load.linear)


@cache
def of(load, eqs, h=0.05, duration=160.0):
    """State, Csmooth and ledger; the voltage is some 50 V, below the voltage that breaks the diodes
    down."""
    name, parameters = load
    given = (
        Load(resistance=parameters)
        if name == "resistor"
        else Load(netlist=name, parameters=dict(parameters))
    )
    device = worker.CoupledDevice(eqs, scales(eqs.beta or 0.5, 0.01), load_circuit(given, CP), h, 4)
    noise = gaussian_grid(np.random.SeedSequence(7), round(duration / h))
    return next(map_in_workers(finished, [(device, noise, 40.0)]))


STOP = changed(PAPER, mu=None, c1=-0.05, beta=0.5)
RESISTOR = ("resistor", 1e6)
COIL = (("L", 2.0), ("Rcoil", 1.2e3), ("Rcore", 500e3))
LOADS = {  # the step, and the load's share of what it and the circuit take, at the seed above
    "resistor": (RESISTOR, 0.05, 1.0),
    "bridge": (("bridge", (("R", 1e6), ("C", 1e-6))), 0.05, 0.95),
    "doubler": (("doubler", (("R", 2e6),)), 0.05, 0.96),
    "parallel_sshi": (
        ("parallel_sshi", COIL),
        0.025,
        0.47,
    ),  # 0.468 at half the step, 0.471 at a hundredth of the tolerance
    "series_sshi": (("series_sshi", COIL), 0.025, 0.56),
    # its voltage falls to zero within a hundredth of a time unit
    "sece": (("sece", ()), 0.01, 0.77),
}


@pytest.mark.parametrize("name", LOADS)
def test_ledger_closes_within_a_percent(name):
    """With random motion against a stop and strong coupling, so that every entry counts; the load gets its share."""
    load, h, share = LOADS[name]
    _, _, found = of(load, STOP, h)
    assert abs(found.residual) < 0.01
    assert found.input > 0.0
    assert found.damping > 0.1 * found.input
    assert found.impacts > 0.05 * found.input
    assert (found.circuit > 0.0) == (name != "resistor")
    assert found.load / (found.load + found.circuit) == pytest.approx(share, rel=0.04)


@pytest.mark.thorough("test_ledger_closes_within_a_percent")
def test_works_of_a_kick_are_the_change_of_the_kinetic_energy():
    """Sum of all works = (v1^2 - v0^2)/2, to rounding, with every effect and with few."""
    rng = np.random.default_rng(2)
    kick_, work_ = interpreted(kick), interpreted(add_works_of_kick)
    for eqs in (PAPER, Equations(n1=1.0), Equations(beta=2.0, c1=-0.3)):
        s = SimpleNamespace(noise_work=0.0, spring_work=0.0, voltage_work=0.0, damping_work=0.0)
        kinetic = 0.0
        for x, v0, voltage, xi in rng.standard_normal((100, 4)):
            v1 = kick_(State(x, v0, voltage), xi, 0.1, eqs)
            work_(s, v0, v1, x, voltage, xi, 0.1, eqs)
            kinetic += 0.5 * (v1**2 - v0**2)
        assert sum(vars(s).values()) == pytest.approx(kinetic, rel=1e-11)
        assert (s.damping_work == pytest.approx(0.0, abs=1e-13)) == (eqs.c1 is None)


def test_stored_energy_is_that_of_every_spring():
    """v^2/2 + linear x^2/2 + alpha2 x^3/3 + alpha x^4/4 + what a compliant stop stores, k y^2/2 of its depth y."""
    x = -1.3
    v = 0.7
    contact = 0.11
    alpha = 0.4
    linear = -1.0
    alpha2 = 0.9
    s = SimpleNamespace(measuring=BEFORE, since=1.0, x=x, v=v)
    point = Point(2.0, 0.3, 0.0, 0.0, 0.2)
    c = Coefficients(alpha=alpha, linear=linear, alpha2=alpha2)
    interpreted(note_stored_energy)(s, point, interpreted(stored_in_mass)(s, contact, c))
    energy = v**2 / 2 + linear * x**2 / 2 + alpha2 * x**3 / 3 + alpha * x**4 / 4 + contact
    assert s.measuring == DURING
    assert s.energy_begin == pytest.approx(energy, rel=1e-12)
    assert (s.begin, s.voltage_begin, s.smooth_begin) == (2.0, 0.3, 0.2)
    in_contact = interpreted(contact_energy)
    at_rest, apart = Coefficients(k=50.0, gap=0.0), Coefficients(k=50.0, gap=0.2)
    assert [in_contact(-0.1, at_rest), in_contact(-0.3, apart)] == pytest.approx(
        [0.25, 0.25], rel=1e-12
    )
    assert [in_contact(0.1, at_rest), in_contact(-0.1, apart)] == [0.0, 0.0]


@pytest.mark.thorough("test_ledger_closes_within_a_percent")
def test_without_circuit_and_damping_the_mechanical_side_closes_exactly():
    """beta None, no stop: noise alone; the kicks telescope, so that the residual is the spring's O(h^2) only."""
    residuals = [
        abs(of(RESISTOR, Equations(n1=0.01, c1=-0.05), h, 400.0)[2].residual) for h in (0.1, 0.025)
    ]
    assert residuals[0] < 3e-3
    assert residuals[1] < 3e-4


def test_a_resistor_takes_what_the_terminals_give():
    """Integral of v i in ngspice against that of the load's power: the currents are the same, to rounding."""
    s, _, _ = of(RESISTOR, STOP, 0.05)
    assert s["delivered"] == pytest.approx(s["load"], rel=1e-9)


def test_terminal_current_is_the_charge_that_the_mass_moved():
    """Integral of v i + change of Cp v^2/2 against the work of the force -beta V: the same, to the step's order."""
    for name in ("bridge", "sece"):
        load, h, _ = LOADS[name]
        s, _, _ = of(load, STOP, h)
        scale = scales(STOP.beta, 0.01)
        joules = scale.mass * (scale.frequency * scale.length) ** 2
        gone = s["delivered"] + 0.5 * CP * (s["voltage_end"] ** 2 - s["voltage_begin"] ** 2)
        assert gone == pytest.approx(-joules * s["voltage_work"], rel=0.01)


def test_smoothing_capacitor_is_read_from_ngspice():
    assert of(LOADS["bridge"][0], STOP, 0.05)[1] == pytest.approx(1e-6)
    assert of(RESISTOR, STOP, 0.05)[1] == 0.0


def test_charging_curve():
    """Csmooth starts empty, is charged to the voltage that the ledger ends with, and is positive all the way."""
    bridge = load_circuit(Load(netlist="bridge", parameters={"C": 1e-6}))
    device = worker.CoupledDevice(STOP, scales(0.05), bridge, 0.1, 4)
    noise = gaussian_grid(np.random.SeedSequence(7), 4000)
    t, v, _ = charging_curve(device, noise)
    s, _, _ = next(map_in_workers(finished, [(device, noise, 50.0)]))
    assert t[-1] == pytest.approx(400.0 / 20.0, rel=1e-3)
    assert v[0] == pytest.approx(0.0, abs=0.01)
    assert v[-1] == pytest.approx(s["smooth_end"], rel=1e-2)
    assert v[-1] > 1.0
    assert (v > -1e-3).all()


def test_a_load_without_smoothing_capacitor_has_no_charging_curve():
    device = worker.CoupledDevice(STOP, scales(0.05), load_circuit(Load(resistance=1e6)), 0.1, 4)
    _, v, smoothing = charging_curve(device, np.zeros(40))
    assert smoothing == 0.0
    assert (v == 0.0).all()


@pytest.mark.thorough("test_ledger_closes_within_a_percent")
def test_one_way_drive_takes_nothing_from_the_mass():
    """Without beta the voltage has no force: the mass moves as with an open circuit, and the ledger still closes."""
    one_way = Equations(c1=-0.05, n1=0.01)
    s, _, found = of(LOADS["bridge"][0], one_way)
    assert s["voltage_work"] == 0.0
    assert found.load > 0.0
    assert abs(found.residual) < 0.01
