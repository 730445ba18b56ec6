"""Engine `slow` beside ngspice alone, whose results are kept: the device is a mesh of ngspice's own elements there.

    python benchmarks/slow_circuits.py examples/bimorph_ltc3588.toml 20 2e-5
    python benchmarks/slow_circuits.py examples/bimorph_bq25570.toml 20 2e-5 1e-5
    python benchmarks/slow_circuits.py examples/bimorph_node.toml 40 2e-5 1e-3

with ngspice 39.3 on 23 November 2026, the last on 25 November; minutes each.
"""

import dataclasses
import math
import time
from types import SimpleNamespace

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.engines import slow
from harvester.engines.compiled import Compiled
from harvester.engines.moment_existence import MomentExistence
from harvester.engines.selection import default_engine
from harvester.engines.slow import AVERAGING, TOGETHER
from harvester.equations.problem import Problem
from harvester.errors import SimulationError
from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.step_size import step_from_rest
from harvester.presentation.diagnostic import has, warning
from harvester.presentation.messages.unknown_parts import OWN_CLOCK, QUICK_UNDER_NOISE, RARE_MOTIONS
from harvester.storage import checked_mean, noisy_power
from harvester.storage.checked_mean import SlowPower
from tests.support.paths import EXAMPLES

AT_THE_LOAD = ("load_on", "load_on_after", "store_lowest", "store_highest")

# Mean power (W) of whole cycles, and what ngspice itself changes by from steps of 50 us to 20 us,
# or by its reltol.
NGSPICE = {"ltc3588": (183.465e-6, 0.3e-6), "bq25570": (71.053e-6, 1.3e-6)}
# When the storage capacitor of examples/bimorph_node.toml has a voltage (s): just before its output
# begins, and with the node on. At steps of 50 us it has them 0.2 ms later and 1.8 ms sooner; at a
# reltol of 1e-4 ngspice stops at 1.634 s.
NODE = {"5 V": 1.6298, "10 V": 10.0871}
# Of an LTC3588 at another shaking or store, and on examples/bimorph_sensor.toml, at 20 us and
# reltol 1e-4 (24 November 2026).
OTHERS = [
    ("bimorph_ltc3588", "0.15 g", "10 uF", 184.11e-6),
    ("bimorph_ltc3588", "0.3 g", "10 uF", 676.9e-6),
    ("bimorph_ltc3588", "0.3 g", "47 uF", 681.24e-6),
    ("bimorph_sensor", "0.3 g", "10 uF", 117.60e-6),
    ("bimorph_sensor", "0.3 g", "47 uF", 116.65e-6),
]


@pytest.mark.thorough("test_by_slow.py")
@pytest.mark.slow
@pytest.mark.parametrize("name", NGSPICE)
def test_a_chip_takes_what_it_takes_in_ngspice(name):
    found = hv.run(EXAMPLES / f"bimorph_{name}.toml", "slow")
    (power, change) = NGSPICE[name]
    assert abs(found.mean_power.value - power) < found.mean_power.error95 + change
    assert found.mean_power.error95 < 0.025 * power
    assert has(found.diagnostics, "slow_circuit_alone", "run_directly") and not found.warnings
    assert found.mean_square_voltage.error95 > 0.0


@pytest.mark.thorough("test_by_slow.py")
@pytest.mark.parametrize("name, acceleration, store, power", OTHERS)
def test_an_ltc3588_takes_what_it_takes_in_ngspice(name, acceleration, store, power):
    scene = hv.load(EXAMPLES / f"{name}.toml").vary(
        "excitation.acceleration_amplitude", acceleration
    )
    scene = scene.with_load(netlist="ltc3588", parameters={"R": 10e3, "C": store})
    if name == "bimorph_ltc3588":
        scene = scene.vary("load.parameters.Cout", "10 uF")
    found = hv.run(scene, "slow").mean_power
    assert abs(found.value - power) < found.error95 + 0.002 * power
    assert found.error95 < 0.04 * power


@pytest.mark.thorough("test_by_slow.py")
def test_a_quick_answer_is_near_and_says_what_it_does_not_know():
    """The page's first answer: within what it states of the whole one; a lighter load is on for longer."""
    scene = hv.load(EXAMPLES / "bimorph_ltc3588.toml")
    soon, whole = hv.Slow().quick(scene), hv.Slow().run(scene)
    assert abs(soon.mean_power.value / whole.mean_power.value - 1.0) < 0.01
    assert soon.mean_power.error95 is None and soon.mean_power.bias in (None, 0.0)
    on = whole.details["load_on"]
    error = whole.details["error_of_load_on"]
    assert 0.0 < error < 0.05 * on
    assert f"{100.0 * on:.4g} % +- {100.0 * error:.2g} % (95 %)" in str(whole)
    assert soon.details["load_on"] == pytest.approx(on, abs=0.01)
    assert all(soon.details[f"error_of_{name}"] == math.inf for name in AT_THE_LOAD)
    assert str(soon).count("(error not known)") == len(AT_THE_LOAD)
    assert on * 3.3**2 / 10e3 == pytest.approx(whole.mean_power.value, rel=0.1)  # 3.3 V while on
    assert (
        3.67 - 0.05 < whole.details["store_lowest"] < whole.details["store_highest"] < 5.05 + 0.05
    )
    lighter = hv.Slow().quick(scene.vary("load.parameters.R", 20e3))
    assert lighter.details["load_on"] > 1.5 * on


@pytest.mark.thorough("test_by_slow.py")
def test_each_number_of_a_chip_has_an_error_that_holds():
    """Mass and circuit together, from rest, through two of the output's cycles."""
    scene = hv.load(EXAMPLES / "bimorph_ltc3588.toml")
    known = hv.Slow().run(scene).details
    error = {name: known[f"error_of_{name}"] for name in AT_THE_LOAD}
    assert all(0.0 < error[name] < 0.05 * known[name] for name in AT_THE_LOAD)
    after = known["load_on_after"]
    problem = Problem.of(scene)
    h = step_from_rest(problem.equations)
    n_steps = round(2.0 * after * problem.scales.frequency / h / 16.0) * 16
    circuit = compiled_circuit(problem.load_circuit, problem.scales)
    path = circuit.trace(problem.equations, np.zeros(n_steps), h, 16)
    t = np.arange(1.0, len(path.square) + 1.0) * 16.0 * h / problem.scales.frequency
    first = t[(path.square > 1e-3 * path.square[-1]).argmax()]
    settled = path.voltages[t > 1.2 * after, 1]
    assert abs(first - after) <= error["load_on_after"]
    assert abs(settled.min() - known["store_lowest"]) <= error["store_lowest"]
    assert abs(settled.max() - known["store_highest"]) <= error["store_highest"]


@pytest.mark.thorough("test_by_slow.py")
def test_a_quick_answer_of_a_chip_that_tracks_is_within_five_per_cent():
    """Its slow run is a fifth as long, with a coarser tolerance: a quarter of the time."""
    scene = hv.load(EXAMPLES / "bimorph_bq25570.toml")
    soon, whole = hv.Slow().quick(scene), hv.Slow().run(scene)
    assert soon.mean_power.value == pytest.approx(whole.mean_power.value, rel=0.05)
    assert soon.steps < 0.1 * whole.steps


@pytest.mark.thorough("test_by_slow.py")
def test_the_averages_cover_whole_cycles_of_a_chips_clock():
    """Its first run has one sampling of the input, near its end; the direct run has two cycles."""
    scene = hv.load(EXAMPLES / "bimorph_bq25570.toml").vary("oscillator.damping_ratio", 0.3)
    scene = scene.vary("excitation.acceleration_amplitude", "1.2 g")
    found = hv.run(scene, "slow")
    known = found.details
    problem = Problem.of(scene)
    h = step_from_rest(problem.equations)
    circuit = compiled_circuit(problem.load_circuit, problem.scales)
    path = circuit.trace(
        problem.equations, np.zeros(round(34.0 * problem.scales.frequency / h)), h, 1
    )
    t = h / problem.scales.frequency * np.arange(1.0, len(path.square) + 1.0)
    cycle = (t > 1.5) & (t <= 33.5)
    gained = np.ptp(path.square[cycle])
    power = gained / 32.0 / circuit.resistance
    assert abs(found.mean_power.value - power) < found.mean_power.error95 < 0.02 * power
    store = path.voltages[cycle, 1]
    assert abs(store.max() - known["store_highest"]) < known["error_of_store_highest"]
    assert abs(store.min() - known["store_lowest"]) < known["error_of_store_lowest"]
    assert known["duration"] > 64.0 and not found.warnings
    assert store.max() > 3.5 and store[t[cycle] < 16.0].max() < 3.0  # the sampling makes it


@pytest.mark.thorough("test_by_slow.py")
def test_a_clock_too_slow_for_the_longest_run_is_named(monkeypatch):
    monkeypatch.setattr(checked_mean, "MOST", 100.0 * checked_mean.FINER)
    found = hv.run(EXAMPLES / "bimorph_bq25570.toml", "slow")
    assert has(found.diagnostics, "clock_not_covered")
    assert found.mean_power.error95 is None and OWN_CLOCK in found.mean_power.unknown
    soon = hv.Slow().quick(hv.load(EXAMPLES / "bimorph_bq25570.toml"))
    assert OWN_CLOCK in soon.mean_power.unknown


@pytest.mark.thorough("test_by_slow.py")
def test_a_node_behind_a_chip_is_always_on():
    """Its resistor of 1 Mohm takes 3.3 V squared over that."""
    found = hv.run(EXAMPLES / "bimorph_node.toml")
    assert found.engine == "slow"
    assert found.mean_power.value == pytest.approx(3.3**2 / 1e6, rel=2e-3)


@pytest.mark.thorough("test_by_slow.py")
@pytest.mark.parametrize("volts", NODE)
def test_the_store_of_a_node_behind_a_chip_has_a_voltage_when_it_has_it_in_ngspice(volts):
    found = hv.charge(EXAMPLES / "bimorph_node.toml", to=volts, duration="12 s", engine="slow").time
    assert abs(found.value - NODE[volts]) < found.known_error95 + 2e-3
    assert found.known_error95 < 0.02 * found.value


def under_noise(chip, store, cout="10 uF"):
    """The chip's example with a storage capacitor, under the noise of docs/charging.md."""
    scene = hv.load(EXAMPLES / f"bimorph_{chip}.toml").vary("load.parameters.C", store)
    scene = scene.vary("load.parameters.Cout", cout)
    return dataclasses.replace(scene, excitation=hv.Excitation(acceleration_psd="0.002 g^2/Hz"))


# Mean power (W) under noise by direct runs and its standard error: `run --engine compiled
# --trajectories 64`, of the third with --duration 48s; of the first also by ngspice, `run --engine
# spice`, with its total error (25 Nov 2026).
DIRECTLY = [
    ("ltc3588", "10 uF", "10 uF", 201.3e-6, 0.8e-6),
    ("ltc3588", "100 uF", "10 uF", 202.70e-6, 0.14e-6),
    ("bq25570", "2.2 uF", "1 uF", 137.02e-6, 0.13e-6),
]
IN_NGSPICE = 198.7e-6, 9.9e-6


@pytest.mark.slow
def test_a_chip_under_noise_takes_what_it_takes_in_direct_runs():
    """Its error is whole: sampling, step and model; the storage capacitor cycles between the lockout's thresholds."""
    chip, store, cout, power, stderr = DIRECTLY[0]
    found = hv.run(under_noise(chip, store, cout))
    assert found.engine == "slow" and not found.warnings
    assert abs(found.mean_power.value - power) < found.mean_power.error95 + 2.0 * stderr
    assert abs(found.mean_power.value - IN_NGSPICE[0]) < found.mean_power.error95 + IN_NGSPICE[1]
    assert found.mean_power.error95 < 0.045 * power and found.mean_power.stderr > 0.0
    assert (
        3.67 - 0.15 < found.details["store_lowest"] < found.details["store_highest"] < 5.05 + 0.05
    )


@pytest.mark.thorough("test_a_chip_under_noise_takes_what_it_takes_in_direct_runs")
@pytest.mark.statistics
@pytest.mark.parametrize("chip, store, cout, power, stderr", DIRECTLY[1:])
def test_more_chips_under_noise_take_what_they_take_in_direct_runs(
    chip, store, cout, power, stderr
):
    for seed in (0, 1):
        found = hv.run(under_noise(chip, store, cout), "slow", seed=seed).mean_power
        assert abs(found.value - power) < found.error95 + 2.0 * stderr, seed
        assert found.error95 < 0.07 * power


@pytest.mark.thorough("test_a_chip_under_noise_takes_what_it_takes_in_direct_runs")
@pytest.mark.slow
@pytest.mark.ngspice
def test_a_chip_whose_store_is_not_slow_under_noise_runs_directly(monkeypatch):
    """A storage capacitor of 0.47 uF is full within two vibrations.

    Taking the scales apart changes the power by 2 %, which its error holds; if that is more than
    is borne, mass and circuit run together, and the answer states so.
    """
    scene = under_noise("ltc3588", "0.47 uF")
    beside = hv.run(scene, "compiled", trajectories=64, seed=1).mean_power
    apart = hv.run(scene, "slow")
    monkeypatch.setattr(noisy_power, "LARGEST_SEPARATION", 0.01)
    found = hv.run(scene, "slow")
    assert has(apart.diagnostics, "slow_circuit_alone") and not has(
        apart.diagnostics, "run_directly"
    )
    assert found.engine == "slow" and has(found.diagnostics, "run_directly")
    for power in (apart.mean_power, found.mean_power):
        assert abs(power.value - beside.value) < power.error95 + beside.error95


def test_quick_answers_are_smooth_about_a_resonance():
    """Sensitivities are differences of them: they had the noise of currents that were not settled."""
    board = hv.load(EXAMPLES / "bimorph_board.toml")
    changes = np.linspace(-0.01, 0.01, 9)
    scenes = [board.vary("excitation.frequency", 46.0 * (1.0 + float(x))) for x in changes]
    powers = np.log([answer.mean_power.value for answer in hv.Slow(judged=False).run_many(scenes)])
    smooth = np.polynomial.Polynomial.fit(changes, powers, 4)
    assert np.std(powers - smooth(changes), ddof=5) < 6e-4


def test_a_quick_answer_under_noise_is_near():
    soon = hv.Slow().quick(under_noise("ltc3588", "10 uF"))
    assert soon.mean_power.value == pytest.approx(DIRECTLY[0][3], rel=0.06)
    assert soon.mean_power.error95 is None


@pytest.mark.parametrize(
    "excitation, oscillator",
    [
        (
            {
                "acceleration_psd": "0.002 g^2/Hz",
                "frequency": "46 Hz",
                "acceleration_amplitude": "0.1 g",
            },
            {},
        ),
        ({"acceleration_psd": "0.002 g^2/Hz"}, {"stiffness": -1364.1, "cubic_stiffness": 1e9}),
    ],
)
def test_noise_beside_a_drive_or_several_wells_are_not_for_it(excitation, oscillator):
    scene = hv.load(EXAMPLES / "bimorph_ltc3588.toml")
    changed = dataclasses.replace(scene.oscillator, **oscillator)
    with pytest.raises(hv.CannotServeError, match="one resting position"):
        hv.run(
            dataclasses.replace(scene, oscillator=changed, excitation=hv.Excitation(**excitation)),
            "slow",
        )


def test_it_is_for_chips_under_a_drive_or_noise():
    assert default_engine(EXAMPLES / "bimorph_bq25570.toml") == "slow"
    assert default_engine(under_noise("bq25570", "10 uF")) == "slow"
    assert default_engine(EXAMPLES / "bimorph_bq25570.toml", probe=["store"]) == "spice"
    for name in ("plate_bridge", "bimorph_self_powered_sshi", "plate"):
        with pytest.raises(hv.CannotServeError):
            hv.run(EXAMPLES / f"{name}.toml", "slow")


def test_a_direct_run_under_noise_is_as_long_as_the_budget_allows(monkeypatch):
    """By the measured cost of mass and circuit together; a run that would be too short is left out."""
    problem = Problem(under_noise("ltc3588", "0.47 uF"))
    asked = []

    def run(self, problem, progress=None):
        asked.append((self.duration, self.budget))
        raise SimulationError("it is enough to know what was asked for")

    monkeypatch.setattr(Compiled, "run", run)

    def directly(pace, seconds):
        """The options of a run, at so many seconds of computing per simulated second."""
        solution = SimpleNamespace(duration=8.0, pace=pace, separation=0.1, clock=0.0)
        deadline = time.perf_counter() + seconds
        assert hv.Slow(budget=seconds)._directly(problem, solution, None, deadline) is None
        return asked

    assert directly(pace=10.0, seconds=1.0) == []  # 2 s would need an hour
    (duration, budget), *_ = directly(pace=1e-3, seconds=60.0)
    assert duration == pytest.approx(TOGETHER * 8.0) and budget == pytest.approx(60.0, abs=1.0)
    asked.clear()
    (shorter, _), *_ = directly(pace=0.1, seconds=20.0)
    assert shorter == pytest.approx(AVERAGING * 20.0 / (BATCH * 0.1), rel=0.05)


def of_scales_not_apart(monkeypatch, direct):
    """The answer for a chip under noise whose scales are not apart, of 0.1 mW; the ``direct`` run may be None."""
    power = hv.Value(1e-4, 2e-6, bias=1e-6, model=5e-6)
    solution = SlowPower(
        power=power,
        square=power,
        changed=0.0,
        separation=0.08,
        scales_apart=False,
        direct=3.0,
        duration=8.0,
        slow_step=1e-3,
        steps=100,
        current=None,
        load={},
        pace=1e-3,
    )
    monkeypatch.setattr(noisy_power, "noisy_power", lambda *given: solution)

    def run(self, problem, progress=None):
        if direct is None:
            raise SimulationError("no step of it settles in the budget")
        return direct

    monkeypatch.setattr(Compiled, "run", run)
    return hv.run(under_noise("ltc3588", "0.47 uF"), "slow", budget="60s", within="1%")


def test_a_direct_run_that_fails_leaves_the_answer_of_the_slow_circuit(monkeypatch):
    """With its total error, which the warning explains; the quick answer has none."""
    found = of_scales_not_apart(monkeypatch, None)
    power = found.mean_power
    assert power.value == pytest.approx(1e-4) and power.error95 == pytest.approx(9.92e-6)
    assert has(found.notes, "slow_circuit_alone") and not has(found.notes, "run_directly")
    assert has(found.warnings, "scales_not_apart") and has(found.warnings, "steady_within")
    assert not has(found.warnings, "quick_in_budget")


@pytest.mark.ngspice
def test_a_direct_run_states_its_own_duration_and_a_missed_target(monkeypatch):
    own = hv.Compiled(trajectories=2, duration=0.05).run(under_noise("ltc3588", "0.47 uF"))
    found = of_scales_not_apart(monkeypatch, own)
    (said,) = (one for one in found.notes if one.code == "run_directly")
    assert said.numbers["direct"] == own.details["duration"] > 0.049
    assert has(found.warnings, "steady_within")


def test_a_quick_answer_states_a_missed_target():
    """Under noise, and in a budget that leaves no other: its error is not known."""
    scene = hv.load(EXAMPLES / "bimorph_ltc3588.toml")
    for found in (
        hv.Slow(within="1%", budget=0.05).run(scene),
        hv.Slow(within="1%", judged=False).run(scene),
    ):
        assert [one.numbers["error"] for one in found.warnings if one.code == "steady_within"] == [
            None
        ]


def test_a_quick_answer_under_noise_names_all_that_it_does_not_know(monkeypatch):
    """Sampling and step, and motions that are rare; each answer states so, judged or not."""
    scene = under_noise("ltc3588", "10 uF")
    assert hv.Slow().quick(scene).mean_power.unknown == QUICK_UNDER_NOISE
    assert "sampling, the time step" in QUICK_UNDER_NOISE
    rare = MomentExistence(None, warning("error_unknown", part=RARE_MOTIONS), RARE_MOTIONS)
    monkeypatch.setattr(slow, "existence", lambda problem: rare)
    for chosen in (hv.Slow(judged=False), hv.Slow(budget=0.05)):
        found = chosen.run(scene)
        assert found.mean_power.unknown == f"{QUICK_UNDER_NOISE} and {RARE_MOTIONS}"
        assert has(found.warnings, "error_unknown")
