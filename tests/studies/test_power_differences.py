"""Normalised sensitivities as differences of an engine's power: formulas, a budget, failures, and a
board with a slow circuit."""

import math
import random
import time
from dataclasses import dataclass, replace

import pytest

import harvester as hv
from harvester.answers.estimate import Estimate
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.studies.power_differences import by_differences, first_change
from tests.support.netlists import BRIDGE
from tests.support.paths import ROOT

PLATE = Problem(hv.load(ROOT / "examples" / "plate.toml"))
VALUES = {
    "piezo.capacitance": PLATE.scene.piezo.capacitance,
    "oscillator.damping": PLATE.scene.oscillator.damping,
}


@dataclass(frozen=True)
class Formula:
    """An engine whose power is a formula of the relative values of two keys."""

    power: object

    def run_many(self, scenes):
        """The answers, or an error if the power is None."""
        return [self._answer(scene) for scene in scenes]

    def _answer(self, scene):
        a = scene.piezo.capacitance / VALUES["piezo.capacitance"]
        power = self.power(a, scene.oscillator.damping / VALUES["oscillator.damping"])
        if power is None:
            return SimulationError("no answer here")
        return Estimate(
            engine="formula",
            physical=True,
            mean_power=hv.Value(power, unknown="the model"),
            mean_square_voltage=hv.Value(1.0),
            nondimensional={},
            effects=(),
            seconds=0.0,
            steps=0,
        )


def silent(_):
    """Report nothing."""


def elasticities(power, **options):
    """The differences of a formula."""
    return by_differences(PLATE, Formula(power), VALUES, silent, **options)


def test_a_resonance_is_within_its_error():
    """A power law is exact; a peak narrower than the first change is found by smaller ones."""
    done = elasticities(lambda a, b: a**1.5 / (1.0 + ((b - 1.02) / 0.03) ** 2))
    power_law, peak = (done.by_key[key][1] for key in VALUES)
    assert abs(power_law.value - 1.5) < 1e-9 and power_law.unknown == "the model"
    at = -0.02 / 0.03
    true = -2.0 * at / 0.03 / (1.0 + at**2)
    assert abs(peak.value - true) < 0.05 * true
    assert abs(peak.value - true) < peak.bias < 0.1 * true


def resonator(damping_ratio, detuning, coupling=1e-4):
    """A linear scene under a sinusoid, at so many half-widths from its resonance."""
    return hv.Scene(
        oscillator=hv.Oscillator(mass=0.01, frequency=60.0, damping_ratio=damping_ratio),
        piezo=hv.Piezo(coupling=coupling, capacitance=50e-9),
        excitation=hv.Excitation(
            acceleration_amplitude=1.0, frequency=60.0 * (1.0 + damping_ratio * detuning)
        ),
        load=hv.Load(resistance=50e3),
    )


@pytest.mark.parametrize("damping_ratio", [0.01, 1e-3, 1e-4])
@pytest.mark.parametrize("detuning", [0.0, 0.3, 1.0])
def test_a_formula_beside_its_resonance(damping_ratio, detuning):
    """No key is left out, and all have the slope of the power, however narrow the resonance."""
    scene = resonator(damping_ratio, detuning)
    found = hv.sensitivity(scene)
    assert len(found.keys) == 8 and not found.warnings
    step = 1e-3 * damping_ratio
    for key, value, elasticity in zip(found.keys, found.values, found.elasticities, strict=True):
        more, less = (
            hv.Exact().run(scene.vary(key, value * (1.0 + sign * step))).mean_power.value
            for sign in (1, -1)
        )
        slope = math.log(more / less) / (2.0 * step)
        assert abs(elasticity.value - slope) < elasticity.bias + 1e-5 * max(abs(slope), 1.0)
        assert elasticity.bias < 0.01 * max(abs(slope), 1.0)


def test_changes_wider_than_a_resonance_are_named():
    """Differences that are nearly 0 on both flanks agree, but do not converge."""
    found = hv.sensitivity(resonator(1e-7, 0.3, coupling=1e-8))
    (unsettled,) = (one for one in found.warnings if one.code == "keys_unsettled")
    assert "excitation.frequency" in str(unsettled) and "piezo.capacitance" not in str(unsettled)


def noise(seed, b):
    """Noise of a relative value, the same at each call."""
    return 0.003 * (2.0 * random.Random(f"{seed} {b}").random() - 1.0)


def test_the_error_holds_the_noise_of_a_table():
    """Two differences that agree by chance state no small error: the error holds nine of ten slopes."""
    off = []
    for seed in range(100):
        done = elasticities(lambda a, b, seed=seed: b**-1.2 * math.exp(noise(seed, b)))
        noisy = done.by_key["oscillator.damping"][1]
        off.append(abs(noisy.value + 1.2) / noisy.bias)
        assert noisy.bias < 2.0
    assert sum(one < 1.0 for one in off) >= 90


def test_changes_under_a_drive_are_within_its_resonance():
    """A key changes by 5 % without a drive, or if it does not move the resonance by half its half-width."""
    narrow = Problem(resonator(0.005, 0.0))
    for key, value, most in (
        ("excitation.frequency", 60.0, 0.0025),
        ("oscillator.frequency", 60.0, 0.0025),
        ("excitation.acceleration_amplitude", 1.0, 0.05),
    ):
        assert first_change(narrow, key, value) == pytest.approx(most, rel=0.05)
    assert first_change(PLATE, "oscillator.damping", VALUES["oscillator.damping"]) == 0.05
    wide = Problem(resonator(0.3, 0.0))
    assert first_change(wide, "excitation.frequency", 60.0) == 0.05


def test_a_key_without_an_answer_leaves_the_others():
    """Its error is kept, and a load without power has none either."""
    done = elasticities(lambda a, b: None if b != 1.0 else a)
    assert [*done.by_key] == ["piezo.capacitance"]
    assert str(done.failed["oscillator.damping"]) == "no answer here"
    done = elasticities(lambda a, b: max(a - 1.0, 0.0))
    assert "no power" in str(done.failed["oscillator.damping"])


def test_keys_beyond_the_deadline_are_left():
    """A deadline that is over leaves all of them but mistakes no error for an answer."""
    done = elasticities(lambda a, b: a, deadline=-math.inf)
    assert done.left == [*VALUES] and not done.by_key and not done.failed


def test_the_first_key_is_not_begun_without_time_for_its_answers():
    """A key needs six answers, each of which lasts for 0.1 s here: half a second is not enough."""

    def slowly(capacitance, damping):
        time.sleep(0.1)
        return capacitance

    begin = time.monotonic()
    done = elasticities(slowly, deadline=begin + 0.5)
    assert done.left == [*VALUES] and done.seconds > 1.2
    assert time.monotonic() - begin < 0.5


BOARD_SCENE = ROOT / "examples" / "bimorph_board.toml"


@pytest.mark.parametrize("scene", [ROOT / "examples" / "plate.toml", BOARD_SCENE])
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"budget": -1}, "`budget` must be above 0, but is -1"),
        ({"budget": "x"}, "`budget` must"),
        ({"within": -1.0}, "`within` must"),
        ({"within": math.nan}, "`within` must"),
        ({"within": "x"}, "`within` must"),
    ],
)
def test_options_are_checked_for_every_scene(scene, options, message):
    """Also if a formula needs neither, and as they were given."""
    with pytest.raises(hv.InputError, match=message):
        hv.sensitivity(scene, **options)


def test_keys_of_further_modes_have_sensitivities():
    """With another unit of mass all powers are the same: the sum of the keys with kg in their units is 1."""
    scene = replace(hv.load(ROOT / "examples" / "two_modes_with_stop.toml"), stop=None)
    found = hv.sensitivity(scene)
    of = dict(zip(found.keys, found.elasticities, strict=True))
    assert found.engine == "exact" and {"mode.2.frequency", "mode.2.damping_ratio"} <= {*of}
    mass = (
        "oscillator.mass",
        "piezo.coupling",
        "piezo.capacitance",
        "mode.2.mass",
        "mode.2.coupling",
    )
    total = sum(of[key].value for key in mass) - of["load.resistance"].value
    assert math.isclose(total, 1.0, abs_tol=1e-6)


def test_a_sinusoid_without_a_load_has_no_power():
    """The message names the missing part, and no engine that would not support it either."""
    scene = replace(resonator(0.01, 0.0), load=None)
    with pytest.raises(hv.InputError, match="`scene` must have a coupling and a load resistance"):
        hv.sensitivity(scene)


BOARD = (
    BRIDGE.format("DX")
    + "C1 a b {Ca}\nR1 a c {Ra}\nC2 c b {Cb}\nRload c b {Rb}\n.model DX D(is={Is} n={N})"
)
# powers of V of the units: scaling all impedances by s and the coupling by 1/sqrt(s)
VOLTS = {"piezo.coupling": -1, "piezo.capacitance": -2} | {
    f"load.parameters.{name}": power
    for name, power in {"Is": -1, "N": 1, "Ca": -2, "Cb": -2, "Ra": 2, "Rb": 2}.items()
}


@pytest.mark.ngspice
@pytest.mark.slow
def test_impedances_scaled_with_the_coupling_leave_the_power_of_a_board(tmp_path):
    """A bridge, a storage capacitor and a load behind it: the gradients cancel, within five times
    the price of the power."""
    path = tmp_path / "board.cir"
    header = ".subckt load p n Is=1n N=1.8 Ca=22u Ra=10k Cb=1u Rb=20k"
    path.write_text(f"* a board\n{header}\n{BOARD}\n.ends\n")
    scene = hv.load(ROOT / "examples" / "bimorph_board.toml").with_load(hv.Load(netlist=str(path)))
    price = hv.Slow().run(scene)
    found = hv.sensitivity(scene)
    of = dict(zip(found.keys, found.elasticities, strict=True))
    assert found.engine == "slow" and found.mean_power.value == price.mean_power.value
    assert found.seconds < 5.0 * max(price.seconds, 1.0)
    error = sum(abs(power) * of[key].bias for key, power in VOLTS.items())
    assert abs(sum(power * of[key].value for key, power in VOLTS.items())) < error < 0.05
    assert of["load.parameters.Rb"].value > 10.0 * of["load.parameters.Rb"].bias


@pytest.mark.ngspice
@pytest.mark.slow
def test_a_budget_for_a_board_is_shared_by_power_and_keys():
    """What is left is named, with the power by the quick circuit if need be."""
    found = hv.sensitivity(BOARD_SCENE, budget="1 s")
    left = [one for one in found.diagnostics if one.code == "keys_left_out"]
    assert found.mean_power.value > 0.0 and (left or len(found.keys) == 16)
