"""What the numbers of a scene mean is true: coupling, fraction of the power, engines."""

import numpy as np
import pytest

import harvester as hv
from harvester.devices.interpretation import engines, meaning, noise_share
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError
from harvester.scene.plausibility import unusual_values
from tests.support.datasheet import SHEET, problem_of
from tests.support.paths import EXAMPLES


@pytest.mark.slow
@pytest.mark.parametrize(
    ("coupling", "how"), [("1e-3 N/V", "strong"), ("1e-4 N/V", "medium"), ("3e-5 N/V", "weak")]
)
def test_coupling(coupling, how):
    """From `strong_from` on a resistor draws (M a)^2/(8 c) on a harmonic base at its best frequency, and not before."""
    found = meaning(problem_of({**SHEET, "coupling": coupling})).facts
    assert found["coupling"] == how
    c = 0.008
    for beta, reached in (
        (0.98 * found["strong_from"] * c, False),
        (1.02 * found["strong_from"] * c, True),
    ):
        w = np.linspace(0.99, 1.2, 4001)[:, None]
        mu = np.geomspace(0.05, 20.0, 801)[None, :]
        velocity = 1.0 / np.abs((1.0 - w * w) / (1j * w) + c + beta / (mu + 1j * w))
        power = 0.5 * beta * mu / (mu * mu + w * w) * velocity**2
        assert (power.max() * 8.0 * c > 0.99999) == reached


def test_share_of_white_noise():
    """The most that beta mu S/N1 is over all loads."""
    for beta, c in ((1.25, 0.008), (0.01, 0.1)):
        mu = np.geomspace(0.01, 100.0, 20001)
        share = beta * mu / (c * (1.0 + beta + mu**2 + c * mu) + beta * mu)
        assert noise_share(beta, c) == pytest.approx(share.max(), rel=1e-6)


@pytest.mark.thorough("test_engines.py")
@pytest.mark.slow
@pytest.mark.parametrize(
    "example", sorted(EXAMPLES.glob("plate*.toml")), ids=lambda path: path.stem
)
def test_engines_that_serve(example):
    """Those that are named do not refuse; those that are not do."""
    scene = hv.load(example)
    if scene.excitation.acceleration_file or scene.excitation.filtered:
        return
    named = engines(Problem(scene))
    for name in ("published", "averaged", "ideal"):
        kind = getattr(hv, name.capitalize())
        try:
            refused = kind.refusal(Problem(scene)) if name == "ideal" else not kind().run(scene)
        except CannotServeError:
            refused = True
        assert bool(refused) == (name not in named)


@pytest.mark.parametrize(
    ("changes", "doubts"),
    [
        ({}, []),
        (
            {"capacitance": "50"},
            [
                "piezo.capacitance is 50 F, far outside of the usual 1e-14 to 0.001 F",
                "is 50 nF meant?",
            ],
        ),
        ({"capacitance": "50 mF"}, ["is 50 nF meant?"]),
        ({"mass": "40e6"}, ["oscillator.mass is 4e+07 kg, far outside of the", "is 40 g meant?"]),
        (
            {
                "capacitance": "50 pF",
                "mass": "1 ug",
                "frequency": "100 kHz",
                "open_circuit_frequency": "101 kHz",
            },
            [],
        ),
        ({"mass": "2000 kg", "frequency": "0.2 Hz", "open_circuit_frequency": "0.21 Hz"}, []),
    ],
    ids=str,
)
def test_values_that_no_device_has_get_a_warning(changes, doubts):
    """A number without its unit, most of all; the published devices, from silicon to tons, get none."""
    sheet = {name: text for name, text in SHEET.items() if name != "coupling"}
    sheet |= {"frequency": "3.2 Hz", "open_circuit_frequency": "4.8 Hz"} | changes
    sheet.pop("stiffness", None)
    words = meaning(problem_of(sheet)).remarks
    words = [str(one) for one in words if one.about == "values"]
    assert bool(words) == bool(doubts)
    assert all(doubt in words[0] for doubt in doubts)


@pytest.mark.parametrize(
    ("own", "warned"), [({}, False), ({"Cp": "50.2 nF"}, False), ({"Cp": "33 nF"}, True)], ids=str
)
def test_a_switch_timed_for_another_piezo_gets_a_warning(own, warned):
    scene = hv.load(EXAMPLES / "plate_parallel_sshi.toml")
    found = unusual_values(scene.with_load(hv.Netlist("parallel_sshi", R="5 Mohm", **own)))
    says = (
        "load.parameters.Cp is 33 nF, but piezo.capacitance is 50.2 nF: left out, it is the piezo's"
    )
    assert [*map(str, found)] == ([says] if warned else [])


def test_a_best_load_that_no_device_has_gets_a_warning():
    """50 F makes it 995 uohm."""
    words = meaning(
        problem_of({**SHEET, "acceleration_psd": "1e-5 g^2/Hz", "capacitance": "50"})
    ).remarks
    (doubt,) = (str(one) for one in words if one.code == "unusual_best_load")
    assert doubt.startswith("the best load is") and "mass, frequency and capacitance" in doubt


DRIVE = {"acceleration_amplitude": "0.5 g", "resistance": "200 kohm"}


@pytest.mark.parametrize("drive", ["3.3 Hz", "10 Hz"])
def test_a_drive_that_misses_the_resonance_gets_a_warning(drive):
    """If the named frequency gives as many times the power as it states, by engine `exact`."""
    problem = problem_of({**SHEET, **DRIVE, "drive_frequency": drive})
    found = meaning(problem)
    words = [str(one) for one in found.remarks if one.code == "drive_off_resonance"]
    assert bool(words) == (drive == "10 Hz")
    if words:
        assert words[0].startswith(
            "the excitation at 10 Hz is 3.14 times the resonance; most power is at "
        )
        there = problem.scene.varied({"excitation.frequency": found.facts["best_drive_frequency"]})
        powers = [hv.Exact().run(scene).mean_power.value for scene in (problem.scene, there)]
        assert powers[0] / powers[1] == pytest.approx(found.facts["drive_share"], rel=1e-3)
        near = [
            hv.Exact()
            .run(there.varied({"excitation.frequency": f * there.excitation.frequency}))
            .mean_power.value
            for f in (0.99, 1.01)
        ]
        assert powers[1] > max(near)


@pytest.mark.parametrize(
    ("changes", "doubt"),
    [
        ({"damping_ratio": "1.5"}, "oscillator.damping_ratio is 1.5, which is Q = 0.33"),
        ({"damping_ratio": "1.5%"}, ""),
        (
            {**DRIVE, "drive_frequency": "50000"},
            "excitation.frequency is 5e+04 Hz, 1.57e+04 times the resonance",
        ),
        ({**DRIVE, "drive_frequency": "100 Hz"}, ""),
    ],
    ids=str,
)
def test_values_that_are_odd_beside_others_get_a_warning(changes, doubt):
    """A percentage without its sign; kilohertz or a typing error."""
    found = unusual_values(problem_of({**SHEET, **changes}).scene)
    assert len(found) == bool(doubt)
    assert all(doubt in str(one) for one in found)
