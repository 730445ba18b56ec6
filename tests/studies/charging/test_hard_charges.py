"""Chips and circuits that power themselves, from empty, in cases that users should not fear: each comes to its end."""

import re

import numpy as np
import pytest

import harvester as hv
from harvester.cosimulation.ngspice.deck import integration_options
from tests.support.bimorph import bimorph

pytestmark = [pytest.mark.ngspice, pytest.mark.slow]

SINE, SHOCK = (
    'acceleration_amplitude = "{} g"\nfrequency = "{} Hz"',
    """profile = "half-sine-shock"
acceleration_amplitude = "200 g"
pulse_duration = "1 ms"
event_rate = "20 Hz"
""",
)
# The circuit, its parameters, the base, the time that is watched, and what the storage capacitor
# bears (V)
CASES = {
    "chip, supercapacitor": (
        "bq25570",
        'R = "5 kohm", C = "1 F", Cout = "1 uF"',
        (0.1, 46),
        "0.04 s",
        1e-3,
    ),
    "chip, store of 1 nF": (
        "bq25570",
        'R = "5 kohm", C = "1 nF", Cout = "1 uF"',
        (0.1, 46),
        "0.04 s",
        4.6,
    ),
    "chip, no source": (
        "bq25570",
        'R = "5 kohm", C = "2.2 uF", Cout = "1 uF"',
        (1e-4, 46),
        "0.1 s",
        1e-3,
    ),
    "chip, far too much": (
        "bq25570",
        'R = "5 kohm", C = "10 nF", Cout = "1 uF"',
        (20, 46),
        "0.02 s",
        4.6,
    ),
    "chip, output shorted": (
        "bq25570",
        'R = "1 mohm", C = "2.2 uF", Cout = "1 uF"',
        (0.1, 46),
        "0.04 s",
        4.6,
    ),
    "chip, output open": (
        "bq25570",
        'R = "10 Gohm", C = "2.2 uF", Cout = "1 uF"',
        (0.1, 46),
        "0.04 s",
        4.6,
    ),
    "chip, 5 kHz": (
        "bq25570",
        'R = "5 kohm", C = "2.2 uF", Cout = "1 uF"',
        (100, 5000),
        "0.005 s",
        4.6,
    ),
    "chip, shocks": ("bq25570", 'R = "5 kohm", C = "2.2 uF", Cout = "1 uF"', None, "0.02 s", 4.6),
    "other chip, shorted": (
        "ltc3588",
        'R = "1 mohm", C = "2.2 uF", Cout = "1 uF"',
        (20, 46),
        "0.1 s",
        22.0,
    ),
    "node, 10 nF": ("node", 'R = "1 Mohm", C = "10 nF", Cout = "1 uF"', (20, 46), "0.03 s", 22.0),
    "self-powered, shocks": (
        "self_powered_sshi",
        'R = "70 kohm", C = "1 uF"',
        None,
        "0.03 s",
        200.0,
    ),
    "switched capacitor, shorted": ("sshc", 'R = "1 mohm", C = "1 uF"', (0.1, 46), "0.02 s", 0.1),
}


@pytest.mark.thorough("test_the_compiled_circuit_charges_as_the_ideal_one")
@pytest.mark.parametrize("case", CASES)
def test_it_comes_to_its_end(case):
    """The storage voltage is a number at all times, never far below 0, and no more than the circuit lets through."""
    netlist, parameters, sine, duration, most = CASES[case]
    text = bimorph(parameters, netlist=netlist)
    plain = SINE.format("0.25", "46")
    assert plain in text
    scene = hv.loads(text.replace(plain, SHOCK if sine is None else SINE.format(*sine)))
    store = hv.charge(scene, "1 V", duration=duration, engine="spice").voltage
    assert np.isfinite(store).all() and len(store) > 10
    assert store.min() > -0.3 and store.max() < most


@pytest.mark.thorough("test_the_compiled_circuit_charges_as_the_ideal_one")
def test_a_supercapacitor_does_not_shorten_the_steps():
    """The tolerance of a charge is above the rounding of 1 F at 20 V, and as ever next to a usual capacitor."""
    usual, mine, large = (
        float(
            re.search(
                r"chgtol=(\S+)", integration_options(1e-4, None, 20.0, 41e-9, 1e-4, smoothing=c)
            )[1]
        )
        for c in (0.0, 10e-6, 1.0)
    )
    assert usual == mine == pytest.approx(1e-8 * 20.0 * 41e-9)
    assert 1e-4 * large > 4.0 * np.finfo(float).eps * 20.0 * 1.0
