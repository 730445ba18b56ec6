"""Tolerances of a netlist within a budget: a board with a storage capacitor, a bridge by compiled
circuits, and refusals."""

import numpy as np
import pytest

import harvester as hv
from harvester.presentation.diagnostic import has
from tests.support.paths import ROOT

BOARD = ROOT / "examples" / "bimorph_board.toml"
PARTS = {"load.parameters.C1": "20%", "load.parameters.R4": "5%", "oscillator.damping_ratio": "10%"}
PLATE = hv.load(ROOT / "examples" / "plate_with_stop.toml").with_load(
    hv.Load(netlist="bridge", parameters={"R": "1 Mohm", "C": "20 nF"})
)

# All these devices are computed long before the time is over, also on a loaded machine.
DEVICES, ENOUGH = 150, "20min"


class Remarks:
    """A progress that keeps the remarks of a study."""

    def __init__(self):
        self.said = []
        self.fractions = []

    def start(self, total=None, what="", done=0):
        """Begin."""

    def step(self, done=1, what=""):
        """Keep the fraction."""
        self.fractions.append(done)

    def close(self):
        """End."""

    def remark(self, text):
        """Keep the remark."""
        self.said.append(text)


@pytest.mark.ngspice
@pytest.mark.slow
def test_a_board_against_devices_one_by_one():
    """The slow circuit of a board: devices and yield of the law against each device computed, and the part to blame."""
    told = Remarks()
    execution = hv.Execution(progress=told)
    limit = ["mean_power > 195 uW"]
    found = hv.tolerance(
        BOARD, vary=PARTS, samples=DEVICES, budget=ENOUGH, limits=limit, execution=execution
    )
    assert found.engine == "slow" and found.off is not None and found.off < 0.12
    assert found.tornado[0].key == "oscillator.damping_ratio"
    first = next(text for text in told.said if text.code == "first_answer")
    assert first.numbers["key"] == "oscillator.damping_ratio"
    assert has(told.said, "law_in_budget") and max(told.fractions) <= 1.0
    scene = hv.load(BOARD)
    scenes = [
        scene.varied(dict(zip(PARTS, map(float, row), strict=True))) for row in found.samples[:150]
    ]
    computed = np.array([a.mean_power.value for a in hv.Slow(judged=False).run_many(scenes)])
    computed *= found.nominal / hv.Slow(judged=False).run(scene).mean_power.value
    ratio = found.power[:150] / computed
    assert (np.abs(ratio - 1.0) < found.off).mean() > 0.95
    assert ratio.std() < 0.02 < np.std(computed) / np.mean(computed)
    share = (computed > 195e-6).mean()
    both = np.sqrt(share * (1.0 - share) / 150)
    assert found.met.low - 4.0 * both < share < found.met.high + 4.0 * both
    exact = hv.Slow().run(scenes[7]).mean_power
    assert abs(exact.value - found.power[7]) < found.off * found.power[7] + exact.known_error95


VARY = {"load.parameters.R": "normal:10%", "piezo.coupling": "normal:5%"}


@pytest.mark.slow
def test_a_bridge_against_devices_on_other_noise():
    """Devices by the ideal circuit on other noise are within the error, and vary as the law states."""
    found = hv.tolerance(PLATE, vary=VARY, budget=ENOUGH, samples=DEVICES, seed=3)
    assert found.engine == "ideal" and found.off is not None
    scenes = [
        PLATE.varied(dict(zip(VARY, map(float, row), strict=True))) for row in found.samples[:40]
    ]
    answers = hv.Ideal(within=0.01, judged=False).run_many(scenes, range(40))
    computed = np.array([answer.mean_power.value for answer in answers])
    errors = np.array([answer.mean_power.known_error95 for answer in answers]) / computed
    assert (np.abs(found.power[:40] / computed - 1.0) < errors + found.off).mean() > 0.9
    assert np.corrcoef(found.power[:40], computed)[0, 1] > 0.9


@pytest.mark.ngspice
@pytest.mark.slow
def test_a_driven_bridge_against_its_periodic_responses():
    """The compiled circuit under a harmonic excitation: devices of the law are within the stated
    error of their own responses."""
    scene = hv.load(ROOT / "examples" / "plate_harmonic.toml").with_load(PLATE.load)
    found = hv.tolerance(scene, vary=VARY, engine="compiled", budget="30s", samples=512)
    assert found.engine == "compiled" and found.off is not None and found.off < 0.05
    scenes = [
        scene.varied(dict(zip(VARY, map(float, row), strict=True))) for row in found.samples[:20]
    ]
    answers = hv.Compiled(judged=False).run_many(scenes)
    computed = np.array([answer.mean_power.value for answer in answers])
    assert (np.abs(found.power[:20] / computed - 1.0) < found.off).mean() >= 0.9


@pytest.mark.ngspice
@pytest.mark.slow
def test_first_order_of_a_board_has_no_sampled_devices():
    """One worker, and a short time: the law, its two places and a judged run."""
    execution = hv.Execution(workers=1)
    vary = {"load.parameters.C1": "20%"}
    found = hv.tolerance(BOARD, vary=vary, runs="first-order", samples=64, execution=execution)
    check = next(d for d in found.diagnostics if d.code == "curved_law_at_corners")
    assert (check.numbers["sampled"], check.numbers["runs"]) == (0, 3)


def test_first_order_has_nothing_to_resume(tmp_path):
    """It would be computed anew, by a judged engine and without the budget."""
    execution = hv.Execution(out=tmp_path, resume=True)
    with pytest.raises(hv.InputError, match="`resume` must be left out with `runs` 'first-order'"):
        hv.tolerance(BOARD, vary=PARTS, runs="first-order", execution=execution)


def test_command_takes_a_budget_or_runs(harvester):
    """Not both, and a budget is a time."""
    words = ("tolerance", BOARD, "--vary", "load.parameters.R4=5%", "--budget")
    status, _, err = harvester(*words, "5s", "--runs", "20")
    assert status == 2 and "--runs must be left out if --budget is given" in err
    status, _, err = harvester(*words, "soon")
    assert status == 2 and "--budget must be a time above 0" in err


@pytest.mark.parametrize("budget", ["soon", 0.0, -1.0, "0s", True, [3]])
def test_a_budget_is_a_time(budget):
    with pytest.raises(hv.InputError, match="`budget` must be "):
        hv.tolerance(BOARD, vary=PARTS, budget=budget)


@pytest.mark.parametrize("runs", [float("inf"), [3], 2.5, True, "2.5", "inf", "", "20s"])
def test_runs_are_a_whole_number(runs):
    """Neither 2.5 nor a list is shortened to a number, and a time is a `budget`."""
    with pytest.raises(hv.InputError, match="`runs` must be a whole number or 'first-order', b"):
        hv.tolerance(PLATE, vary=VARY, runs=runs)


PIEZO = {"piezo.capacitance": "5%"}
PEAK = "peak_displacement < 1"
SINUSOID = hv.Scene(
    nondimensional=hv.Nondimensional(c1=-0.1, beta=0.05, mu=1.0, drive=0.1, drive_frequency=1.0)
)
BY_FORMULA = ROOT / "examples" / "plate.toml"


@pytest.mark.parametrize(
    ("scene", "options", "line"),
    [
        (BOARD, {"budget": 20, "checks": 4}, "`checks` must be left out if `budget` is given"),
        (
            SINUSOID,
            {"runs": "first-order", "limits": PEAK},
            "`limits` must have no peaks with `run",
        ),
        (BOARD, {"budget": "20s", "runs": "first-order"}, "`runs` must be left out if `budget` is"),
        (BY_FORMULA, {"budget": "20s"}, "`budget` must be left out with engine 'exact', but is "),
    ],
)
def test_a_refusal_names_the_option_that_was_given(scene, options, line):
    """Rather than all that a time excludes; peaks under a sinusoid have no lifetime to leave out."""
    with pytest.raises(hv.InputError, match=f"^{line}"):
        vary = {"nondimensional.mu": "5%"} if scene is SINUSOID else PIEZO
        hv.tolerance(scene, vary=vary, **options)
