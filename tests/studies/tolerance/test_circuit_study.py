"""The study of a netlist within a budget, by engines that are formulas of the keys."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

import harvester as hv
from harvester.answers.estimate import Estimate
from harvester.errors import SimulationError
from harvester.machine.progress import NO_PROGRESS, CallingBack, NoProgress
from harvester.presentation.diagnostic import has
from harvester.studies.tolerance.circuit_study import CircuitStudy
from harvester.studies.tolerance.device_limits import parse
from harvester.studies.tolerance.first_order import linear_law
from harvester.studies.tolerance.spreads import spreads
from harvester.studies.tolerance.study import ToleranceRequest, check_devices
from harvester.studies.tolerance.tolerance_result import ToleranceResult
from tests.support.paths import ROOT

PLATE = hv.load(ROOT / "examples" / "plate.toml")
VARY = {"piezo.capacitance": "20%", "oscillator.damping": "20%"}
MIDDLE = np.array([PLATE.piezo.capacitance, PLATE.oscillator.damping])


def joint(a, b):
    """A power whose keys act together."""
    return 1e-6 * (1.0 + a + b + 4.0 * a * b)


@dataclass(frozen=True)
class Formula:
    """An engine whose power is a formula of the two keys' relative changes."""

    power: object = joint
    judged: bool = True
    budget: float | None = None
    within: float | None = None
    trajectories: int | None = None
    # of the judged runs: their power over the others, and how many know their error
    ratio: float = 1.1
    knows: int = 100
    # of the runs that know no error: their standard error over their power
    noise: float = 0.0
    calls: list = field(default_factory=list)

    NAME = "slow"
    has_gradient = False

    def run(self, scene):
        """The answer of one device, or its error."""
        answer = self._answer(scene)
        if isinstance(answer, SimulationError):
            raise answer
        return answer

    def many_at_once(self, problem):
        """One by one."""
        return 1

    def run_many(self, scenes):
        """The answers, or an error if the power is None."""
        return [self._answer(scene) for scene in scenes]

    def _answer(self, scene):
        at = np.array([scene.piezo.capacitance, scene.oscillator.damping]) / MIDDLE - 1.0
        power = self.power(*at)
        if power is None:
            return SimulationError("no answer here")
        self.calls.append(self.judged)
        known = self.judged and sum(self.calls) <= self.knows
        power *= self.ratio if known else 1.0
        parts = {"model": 0.01 * power} if known else {"unknown": "the model" * self.judged}
        value = hv.Value(power, None if known else self.noise * power or None, **parts)
        return Estimate(
            engine=self.NAME,
            physical=True,
            mean_power=value,
            mean_square_voltage=value,
            nondimensional={},
            effects=(),
            seconds=0.0,
            steps=0,
        )


def request(**changes):
    """A study of 256 devices."""
    asked = ToleranceRequest(
        scene=PLATE,
        spreads=spreads(VARY, PLATE),
        matrix=None,
        limits=(),
        lifetime=None,
        samples=256,
        runs=None,
        checks=None,
        within=None,
        seed=0,
    )
    return replace(asked, **changes)


class Remarks(NoProgress):
    """The remarks of a study."""

    def __init__(self):
        self.codes = []

    def remark(self, text):
        """Keep the code of a remark."""
        self.codes.append(text.code)


def study(engine, budget=60.0, draws=True, progress=NO_PROGRESS, **changes):
    """The result of a study in this process."""
    asked = request(**changes)
    execution = hv.Execution(workers=1, progress=progress)
    runs = CircuitStudy(asked, execution, budget, draws=draws).run(engine)
    return ToleranceResult.of(asked, runs, 0.0), runs


def relative(x):
    """The relative changes of the keys."""
    return (x / MIDDLE - 1.0).T


def test_devices_are_those_of_the_formula():
    """The level by the reference, and a polynomial through the joint contribution of both keys."""
    found, _ = study(Formula())
    assert found.power == pytest.approx(1.1 * joint(*relative(found.samples)), rel=2e-3)
    assert "polynomial through the rest" in found.error_from
    assert "1.1 times the others" in found.error_from


def test_a_judge_without_time_does_not_set_the_level():
    """Its answer is the cheap one, with a ratio of 1 that would halve the correction."""
    found, runs = study(Formula(knows=1))
    assert runs.samples.ratio == pytest.approx(1.1)
    assert found.off is not None and "from 1 run with" in found.error_from


def test_corners_in_the_middle_check_nothing():
    """Without sampled devices, and without a slope, the error is not known."""
    found, _ = study(Formula(lambda a, b: 1e-6 * (1.0 + 9.0 * a * b)), draws=False)
    assert found.off is None and found.unexplained == 1.0
    found, _ = study(Formula(lambda a, b: 1e-6 * (1.0 + a - 3.0 * a * a)), draws=False)
    assert found.off > 0.1


def test_a_middle_without_power_has_an_answer():
    """A division by its power would end the study."""
    found, _ = study(Formula(lambda a, b: 1e-6 * max(a + b - 0.01, 0.0)))
    assert found.nominal == 0.0 and np.isfinite(found.power).all()
    assert found.off is None or found.off > 0.1


def test_the_error_of_a_weak_device_is_that_of_others():
    """The law of a sharp peak is clipped at 0: an interval of no width there would be wrong."""
    found, _ = study(
        Formula(lambda a, b: 1e-6 / (1.0 + (a / 0.05) ** 2) / (1.0 + (b / 0.05) ** 2)),
        limits=(parse("mean_power > 0.02 uW"), parse("voltage_rms > 0.1 mV")),
        runs=40,
    )
    weak = found.quantiles[0.05]
    assert weak.high - weak.value > 0.5 * found.off * found.nominal
    expected = 1e-6 / np.prod(1.0 + (relative(found.samples) / 0.05) ** 2, axis=0)
    assert found.met_each[0].low <= (1.1 * expected > 0.02e-6).mean() <= found.met_each[0].high
    assert found.voltages[0.05].high >= np.sqrt(weak.high) * (1.0 - 1e-9)


def test_failures_at_a_few_devices_do_not_fix_the_yield():
    """The share that fails is known from few devices: its interval is in that of the yield."""
    limits = (parse("mean_power > 0.1 uW"),)
    broken = Formula(lambda a, b: None if 0.05 < a < 0.1 and abs(b) > 0.01 else joint(a, b))
    found, runs = study(broken, limits=limits, runs=16)
    assert runs.failed > 0 and found.met.high - found.met.low > 0.2
    all_lost = Formula(lambda a, b: None if abs(a * b) > 1e-9 else joint(a, b))
    found, runs = study(all_lost, limits=limits, runs=16)
    assert found.sample_count == 256 and found.met.low < 0.5


def test_a_device_that_cannot_be_is_refused_before_any_is_computed():
    """A negative capacitance at some device, and a negative resistance of a part."""
    engine = Formula()
    wide = spreads({"piezo.capacitance": "normal:58%", "oscillator.damping": "5%"}, PLATE)
    with pytest.raises(
        hv.InputError, match=r"`vary` must allow all devices, but of one piezo\.cap"
    ):
        study(engine, spreads=wide, samples=2048)
    bridge = PLATE.with_load(hv.Load(netlist="bridge", parameters={"R": "1 Mohm", "C": "20 nF"}))
    wide = spreads({"load.parameters.R": "normal:58%"}, bridge)
    with pytest.raises(
        hv.InputError, match=r"`vary` must keep load\.parameters\.R above 0, but 'n"
    ):
        study(engine, spreads=wide, scene=bridge, samples=2048)
    assert not engine.calls


def test_a_part_is_known_by_the_circuit_rather_than_by_its_key(tmp_path):
    """The parameter ``leak`` may be negative, unless a part then is; a key needs a name."""
    board = tmp_path / "leaky.cir"
    body = ".subckt load p n leak=0.5\nR1 p m {1meg*(1 + leak)}\nRload m n 1meg\n.ends\n"
    board.write_text(body)
    scene = PLATE.with_load(hv.Load(netlist=str(board)))
    leaky = replace(request(scene=scene), spreads=spreads({"load.parameters.leak": "-2:3"}, scene))
    check_devices(leaky, np.array([[0.5], [-0.5], [1.0]]))
    with pytest.raises(hv.InputError, match=r"at load\.parameters\.leak of -2 r1 must be above 0"):
        check_devices(leaky, np.array([[0.5], [-2.0], [1.0]]))
    board.write_text(body.replace("(1 + leak)", "leak"))
    with pytest.raises(hv.InputError, match=r"keep load\.parameters\.leak above 0, but '-2:3'"):
        check_devices(leaky, np.array([[0.5], [-2.0], [1.0]]))
    with pytest.raises(hv.InputError, match=r"unknown .* 'parameters\.'"):
        spreads({"load.parameters.": "1:2"}, scene)


def test_failures_of_judged_runs_and_corners_are_reported():
    """Both are at devices whose keys move the same way; the key's own ends have an answer."""
    found, _ = study(Formula(lambda a, b: None if a * b > 1e-9 else joint(a, b)))
    assert has(found.warnings, "corners_failed") and has(found.warnings, "judged_runs_failed")
    assert "2 of 2 devices" in str(found) and "no answer here" in str(found)


def test_a_key_whose_end_has_no_answer_is_named():
    """With its value, in a budget and at first order."""
    broken = Formula(lambda a, b: None if a > 0.1 else joint(a, b))
    with pytest.raises(SimulationError, match=r"at piezo\.capacitance of \d.*F no answer here"):
        study(broken)
    with pytest.raises(SimulationError, match=r"at piezo\.capacitance of \d.*F, oscillator\.d"):
        linear_law(request(), broken, NO_PROGRESS)


def test_noise_of_the_runs_adds_to_the_error_of_their_law():
    """A slope or a curvature from noisy runs is less sure, whatever the scatter about it is."""
    errors = [study(Formula(noise=noise))[0].off for noise in (0.0, 0.01, 0.02)]
    assert errors[0] < errors[1] < errors[2]
    assert errors[2] - errors[0] == pytest.approx(2.0 * (errors[1] - errors[0]), rel=0.1)


def test_progress_of_a_first_order_grows_to_the_whole():
    """Each device of the law moves the bar: minutes without a change look like a hang."""
    told = []
    progress = CallingBack(lambda done, _: told.append(done))
    linear_law(request(), Formula(judged=False), progress)
    assert told == sorted(told) and told[-1] == 1.0
    assert np.diff([0.0, *told]).max() < 0.5


def test_a_first_order_without_a_known_model_has_no_error():
    """The reference is asked in the middle; if it has no answer, the error is not known."""
    known = linear_law(request(), Formula(judged=False), NO_PROGRESS).samples
    assert known.off["mean_power"] > 0.1  # the reference's power is 1.1 times the others
    unknown = linear_law(request(), Formula(judged=False, knows=0), NO_PROGRESS).samples
    assert unknown.off["mean_power"] is None and has(unknown.checks, "no_error_stated")


def test_a_budget_that_is_spent_has_no_more_runs_and_says_so():
    """The keys' ends alone: no corner, judge or device, and a warning."""
    engine = Formula()
    remarks = Remarks()
    found, _ = study(engine, budget=1e-4, progress=remarks)
    assert len(engine.calls) == 5 and found.off is None
    assert has(found.warnings, "over_budget")
    assert not has(found.warnings, "surface_misses", "law_misses")  # nothing was checked
    assert remarks.codes == ["law_in_budget", "law_beyond_budget", "first_answer"]


def test_a_budget_is_filled_with_devices():
    """More than the 24 of each key, if there is time; for the reference as well, if all devices are few."""
    asked = request(samples=200)
    engine = Formula()
    runs = CircuitStudy(asked, hv.Execution(workers=1), 60.0, fills=True).run(engine)
    assert runs.samples.checks[0].numbers["sampled"] == 200
    found, _ = study(Formula(), samples=16)
    assert found.off is not None and "from 3 runs" in found.error_from
