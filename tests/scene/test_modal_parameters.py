"""A device by its frequencies and its quality factor is the device by its stiffness, damping and coupling."""

import math

import pytest

import harvester as hv

PLATE = hv.Scene(
    oscillator=hv.Oscillator(
        mass="5 g", stiffness=4.0 * math.pi**2 * 18.0, damping_ratio=0.0125, cubic_stiffness=1e4
    ),
    piezo=hv.Piezo(coupling=1.4e-3, capacitance="30 nF"),
    excitation=hv.Excitation(acceleration_psd="1e-3 g^2/Hz"),
    load=hv.Load(resistance="100k"),
)  # 60 Hz, Q = 40


def by_frequencies(scene=PLATE):
    modal = scene.modal
    keys = modal.by_key()
    oscillator = hv.Oscillator(
        mass=modal.mass,
        frequency=keys["oscillator.frequency"],
        q=keys["oscillator.q"],
        cubic_stiffness=1e4,
    )
    piezo = hv.Piezo(
        open_circuit_frequency=keys["piezo.open_circuit_frequency"], capacitance=modal.capacitance
    )
    return hv.Scene(
        oscillator=oscillator, piezo=piezo, excitation=scene.excitation, load=scene.load
    )


def test_frequencies_and_q_say_the_same_device():
    """stiffness = M (2 pi f)^2, damping = sqrt(K M)/Q, theta^2 = Cp (M (2 pi f_oc)^2 - K)."""
    ours = by_frequencies().modal
    other = PLATE.modal
    assert ours.frequency / (2.0 * math.pi) == pytest.approx(60.0, rel=1e-12)
    for name, value in vars(other).items():
        assert getattr(ours, name) == pytest.approx(value, rel=1e-11), name


def test_their_powers_are_equal():
    """The same equations come from both, so that a formula gives the same power but for rounding."""
    power = hv.run(by_frequencies(), "averaged").mean_power.value
    assert power == pytest.approx(hv.run(PLATE, "averaged").mean_power.value, rel=1e-9)


def test_a_varied_key_takes_the_place_of_what_says_the_same():
    """`--vary oscillator.frequency` supports a scene that was written with a stiffness, and back."""
    varied = PLATE.varied({"oscillator.frequency": 61.0, "oscillator.q": 50.0})
    assert varied.oscillator.stiffness is None and varied.oscillator.damping_ratio is None
    assert varied.modal.stiffness == pytest.approx(0.005 * (2.0 * math.pi * 61.0) ** 2, rel=1e-14)
    assert varied.modal.damping == pytest.approx(
        varied.modal.mass * varied.modal.frequency / 50.0, rel=1e-14
    )
    back = varied.varied(
        {"oscillator.stiffness": PLATE.oscillator.stiffness, "oscillator.damping_ratio": 0.0125}
    )
    assert back == PLATE
    coupled = PLATE.vary("piezo.open_circuit_frequency", 70.0)
    assert coupled.piezo.coupling is None
    assert coupled.modal.by_key()["piezo.open_circuit_frequency"] == pytest.approx(70.0, rel=1e-14)


def test_a_sweep_of_the_frequency():
    """The resonance is swept on a scene that has a stiffness; the power is largest where the excitation is."""
    shaken = hv.Scene(
        oscillator=PLATE.oscillator,
        piezo=PLATE.piezo,
        excitation=hv.Excitation(acceleration_amplitude="0.1 g", frequency="62 Hz"),
        load=PLATE.load,
    )
    linear = shaken.varied({"oscillator.cubic_stiffness": 0.0})
    table = hv.sweep(linear, vary={"oscillator.frequency": [58.0, 61.0, 66.0]}, engines=["exact"])
    powers = [value.value for value in table.table["mean_power"]]
    assert powers[1] > powers[0] and powers[1] > powers[2]


@pytest.mark.parametrize(
    ("oscillator", "piezo", "line"),
    [
        (
            {"frequency": 60.0, "stiffness": 16.0},
            {},
            "oscillator.frequency must be left out if stiffness is given, but both are given",
        ),
        ({}, {}, "oscillator.stiffness must be given, but is missing (or oscillator.frequency)"),
        (
            {"frequency": 60.0, "q": 40.0, "damping": 0.1},
            {},
            "oscillator.q must be left out if damping is given, but both are given",
        ),
        (
            {"frequency": 60.0, "q": 0.0},
            {},
            "oscillator.q must be a quality factor, such as 125, above 0",
        ),
        ({"frequency": -60.0}, {}, "oscillator.frequency must be a frequency"),
        (
            {"frequency": 60.0},
            {"open_circuit_frequency": 60.0},
            "piezo.open_circuit_frequency must be above the frequency in short circuit, 60 Hz, but is 60.0",
        ),
        (
            {"frequency": 60.0},
            {"open_circuit_frequency": 61.0, "coupling": 1e-3},
            "piezo.open_circuit_frequency must be left out if coupling is given",
        ),
    ],
)
def test_what_says_no_device(oscillator, piezo, line):
    """Each is one line that names the key."""
    with pytest.raises(hv.InputError) as refused:
        hv.Scene(
            oscillator=hv.Oscillator(mass=0.005, **oscillator),
            piezo=hv.Piezo(**({"capacitance": 3e-8} | (piezo or {"coupling": 1e-3}))),
        )
    assert str(refused.value).startswith(line)


def test_a_bare_key_is_of_the_device_where_the_store_has_one_too():
    """A bare capacitance stays that of the piezo; a bare frequency, of device or excitation, needs its table."""
    assert PLATE.vary("capacitance", 4e-8).piezo.capacitance == 4e-8
    with pytest.raises(
        hv.InputError,
        match="key 'frequency' must be given with its table, but several have it: osc",
    ):
        PLATE.vary("frequency", 61.0)
