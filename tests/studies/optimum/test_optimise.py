"""The largest power: exact optima, boundaries, flat and two-peaked surfaces, coverage of the intervals, the command."""

import csv
import dataclasses
import json
import math
import re

import numpy as np
import pytest
from click.testing import CliRunner

import harvester as hv
from harvester.answers.estimate import Estimate
from harvester.cli import cli
from harvester.engines.protocol import Engine
from harvester.equations.problem import Problem
from harvester.errors import InputError, SimulationError
from harvester.presentation.diagnostic import warning
from harvester.studies.optimum import evaluations, ranges
from harvester.studies.optimum.box_fit import peak_of_box
from harvester.studies.optimum.response_surface import Fit, design_size, exponents
from harvester.studies.optimum.search import SearchRequest
from harvester.uncertainty.value import Value
from tests.support import systems
from tests.support.paths import EXAMPLES

BETA, DAMPING = 0.5, 0.05
LINEAR = systems.scene(systems.linear(BETA, 1.0, DAMPING))
MU = {"nondimensional.mu": (0.05, 20.0)}


def linear_power(mu, beta=BETA):
    return beta * mu * systems.linear_v2(systems.linear(beta, mu, DAMPING))


@dataclasses.dataclass(frozen=True, kw_only=True)
class Surface(Engine):
    """An engine whose power over mu is a given function, with the noise of its trajectories.

    Each trajectory's power is P (1 + a + b cos(3 log mu)), a and b its own: most of the noise is
    common to all places.
    """

    seed: int = 0
    noise: float = 0.0
    shape: str = "two peaks"
    trajectories: int = 4096
    duration: float | None = None

    NAME = "ensemble"

    def run(self, scene, progress=None):
        table = Problem.of(scene).scene.nondimensional
        u = math.log(table.mu)
        if self.shape == "refuses" and table.mu > 1.0:
            raise SimulationError("mu is above 1")
        power = {
            "two peaks": math.exp(-(((u + 1.5) / 0.7) ** 2))
            + 1.1 * math.exp(-(((u - 1.5) / 0.7) ** 2)),
            "flat": 1.0,
            "skewed": 1.0 / (1.0 + math.exp(2.0 * u) + math.exp(-0.5 * u)),
            "refuses": math.exp(-((u + 1.5) ** 2)),
            "no power": 0.0,
        }[self.shape]
        a, b = np.random.default_rng(self.seed).normal(size=(2, self.trajectories)) * self.noise
        samples = power * (1.0 + a + b * math.cos(3.0 * u))
        value = Value(
            float(samples.mean()), float(samples.std(ddof=1) / math.sqrt(self.trajectories))
        )
        details = {"trajectories": self.trajectories}
        return Estimate(
            self.NAME, False, value, value, {}, (), 1e-4, 0, details=details, power_samples=samples
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Hill(Engine):
    """An engine whose power over log mu is a hill with a long tail, of known slopes."""

    middle: float
    width: float
    within: float | None = None
    budget: float | None = None

    NAME = "density"
    has_gradient = True

    @property
    def at_many_points(self):
        return self

    def away(self, scene):
        return (math.log(Problem.of(scene).scene.nondimensional.mu) - self.middle) / self.width

    def run(self, scene, progress=None):
        value = Value(1.0 / (1.0 + self.away(scene) ** 2), bias=0.0)
        return Estimate(self.NAME, False, value, value, {}, (), 1e-4, 0)

    def run_with_slopes(self, scene, progress=None):
        away = self.away(scene)
        return self.run(scene), Elasticity(-2.0 * away / (1.0 + away**2) / self.width)


@dataclasses.dataclass(frozen=True)
class Elasticity:
    """The slope of the logarithm of a power over that of mu, without an error."""

    slope: float

    def elasticity(self, key):
        return self.slope

    def with_error(self, key):
        return Value(self.slope, bias=0.0)


@pytest.mark.parametrize("middle", [-1.3, 0.1, 0.77])
@pytest.mark.parametrize("width", [0.15, 0.4, 1.5])
def test_a_climb_ends_at_the_top(middle, width):
    """Between the places of the scan, by the slopes: one that stays at its start misses the top by up to a half."""
    found = hv.optimise(LINEAR, vary=MU, engine=Hill(middle=middle, width=width))
    assert found.mean_power.value == pytest.approx(1.0, abs=1e-5)
    assert only(found).value == pytest.approx(math.exp(middle), rel=0.01 * width)


@pytest.mark.thorough("test_gradient_is_that_of_differences")
@pytest.mark.slow
def test_density_finds_the_closed_form_by_its_gradient():
    """At sqrt(1 + beta) for small damping, known from `exact`: within the interval that the gradient's error leaves."""
    found = hv.optimise(
        LINEAR, vary={"nondimensional.mu": (0.3, 5.0)}, engine="density", budget=600.0
    )
    exact = hv.optimise(LINEAR, vary={"nondimensional.mu": (0.3, 5.0)}, engine="exact")
    best = only(found)
    assert best.low95 <= only(exact).value <= best.high95
    assert best.high95 - best.low95 < 0.01 * best.value
    assert abs(found.mean_power.value - exact.mean_power.value) <= found.mean_power.error95 + 1e-9
    assert found.evaluation_count < 20
    assert "by_gradient" in {one.code for one in found.diagnostics}


@pytest.mark.thorough("test_gradient_is_that_of_differences")
@pytest.mark.slow
def test_density_stays_at_the_end_of_a_range_where_power_would_rise_beyond():
    found = hv.optimise(
        LINEAR, vary={"nondimensional.mu": (0.1, 0.4)}, engine="density", budget=600.0
    )
    assert (only(found).boundary, only(found).value) == ("high", 0.4)


def only(answer):
    (key,) = answer.keys
    return key


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("load.resistance", "`vary` must be KEY=LOW:HIGH, but is 'load.resistance'"),
        ("load.resistance=1k", "`vary` must be KEY=LOW:HIGH, but is 'load.resistance=1k'"),
        ("load.resistance=1k:2k:3", "`vary` must be KEY=LOW:HIGH, but is"),
        ("load.resistence=1:2", "unknown [load] key 'resistence': did you mean 'resistance'?"),
        (
            "load.resistance=2k:1k",
            "the range of load.resistance must be LOW:HIGH with LOW below HIGH, but is '2000:1000'",
        ),
        (
            "load.resistance=0:1k",
            "load.resistance must be a load resistance (ohm), such as '1 Mohm', above 0",
        ),
    ],
)
def test_what_is_no_range(text, line):
    with pytest.raises(InputError, match=f"^{re.escape(line)}"):
        ranges.parse(text)


@pytest.mark.parametrize(
    ("over", "options", "line"),
    [
        ({}, {}, "`vary` must be given for 1 to 4 keys, but is 0"),
        (
            {"load.resistance": (1.0, 2.0)},
            {},
            "[load] must be left out if [nondimensional] is given",
        ),
        (
            {"nondimensional.restitution": (0.0, 2.0)},
            {},
            "nondimensional.restitution must be a restitution coefficient",
        ),
        (MU, {"within": 2.0}, "`within` must be between 0.001 % and 100 %, but is '2'"),
        (MU, {"budget": 0.0}, "`budget` must be above 0, but is 0.0"),
    ],
)
def test_refused(over, options, line):
    with pytest.raises(InputError, match=f"^{re.escape(line)}"):
        hv.optimise(LINEAR, vary=over, engine="published", **options)


def test_ranges():
    """Logarithmic if the ends differ tenfold; the ends are met to the last digit."""
    log, linear = ranges.parse("load.resistance=1k:10M"), ranges.parse("oscillator.damping=-1:1")
    assert [log.value(u) for u in (0.0, 0.5, 1.0)] == pytest.approx([1e3, 1e5, 1e7], rel=1e-12)
    assert (log.value(0.0), log.value(1.0)) == (1e3, 1e7)
    assert [linear.value(u) for u in (0.0, 0.5, 1.0)] == [-1.0, 0.0, 1.0]


def test_fit_of_a_cubic_is_exact():
    """Without noise a cubic's highest place, its power and its curvature are found to rounding, and nothing is bent."""
    places = 2.0 * ranges.spread(design_size(2), 2) - 1.0
    assert len(exponents(2, 3)) == 10

    def cubic(x, y):
        return (
            3.0
            - (x - 0.2) ** 2
            - 2.0 * (y + 0.1) ** 2
            + 0.3 * (x - 0.2) * (y + 0.1)
            + 0.2 * (x - 0.2) ** 3
        )

    box = np.ones(2)
    fit = Fit(places, cubic(*places.T), 1e-12 * np.eye(len(places)), -box, box, np.zeros((2, 2)))
    assert fit.best == pytest.approx([0.2, -0.1], abs=1e-5)
    assert fit.value(fit.best)[0] == pytest.approx(3.0, rel=1e-10)
    assert fit.hessian == pytest.approx(np.array([[-2.0, 0.3], [0.3, -4.0]]), abs=1e-4)
    assert not fit.on_face.any()
    assert fit.resolution > 1e4


def test_the_interval_of_a_place():
    """The optimum of 1 - x^2 under independent noise: Fieller's widening, and the shift by a step bias."""
    x = np.linspace(-1.0, 1.0, 21)[:, None]
    box = np.ones(1)
    square, fourth = np.sum(x**2), np.sum(x**4)
    noise = 0.25 * math.sqrt(fourth - square**2 / len(x))  # the curvature is 4 standard errors
    fit = Fit(x, 1.0 - x[:, 0] ** 2, noise**2 * np.eye(len(x)), -box, box, np.zeros((2, 1)), 2)
    assert fit.resolution == pytest.approx(4.0)
    alone = 1.959964 * 0.5 * noise / math.sqrt(square)
    assert fit.half_widths == pytest.approx([alone / (1.0 - (1.959964 / 4.0) ** 2)], rel=1e-4)
    peak = peak_of_box(fit, 0.1 * x[:, 0], np.array([0.5]), np.array([0.1]))
    assert 0.5 * (peak.high - peak.low) == pytest.approx(0.1 * (fit.half_widths + 0.05), rel=1e-4)


def test_exact_is_the_default_of_a_linear_scene():
    """P = beta mu S is largest at mu = sqrt(1 + beta): the interval is as narrow as what it was searched to."""
    answer = hv.optimise(LINEAR, vary=MU)
    key = only(answer)
    assert answer.engine == "exact"
    assert key.low95 < math.sqrt(1.0 + BETA) < key.high95 < 1.0001 * key.low95
    assert abs(answer.mean_power.value / linear_power(math.sqrt(1.0 + BETA)) - 1.0) < 1e-9


def test_a_range_may_give_the_scene_a_stop():
    """The engine is chosen for the devices of the ranges, not for the scene without them."""
    vary = {"stop.gap": "0.1 mm:0.2 mm", "stop.restitution": "0.7:0.9"}
    request = SearchRequest.of(EXAMPLES / "plate.toml", vary, None, 0.01, 1.0)
    assert request.engine.NAME == "ensemble"


def test_an_interval_holds_its_own_value():
    """Engine `exact` is known to rounding, which is closer than the climb to the peak comes."""
    scene = hv.load(EXAMPLES / "plate.toml")
    (key,) = hv.optimise(scene, vary={"load.resistance": ("1k", "1M")}, engine="exact").keys
    assert key.low95 < key.value < key.high95


def test_formula_finds_the_exact_optimum():
    """The interval of `averaged` holds it as well."""
    answer = hv.optimise(LINEAR, vary=MU, engine=hv.Averaged())
    key = only(answer)
    assert key.low95 < math.sqrt(1.0 + BETA) < key.high95
    assert key.boundary is None
    power = answer.mean_power
    assert abs(power.value - linear_power(math.sqrt(1.0 + BETA))) < power.known_error95
    # The interval is where the power is within the stated errors: at its ends it just is.
    ends = [
        hv.Averaged().run(LINEAR.vary("nondimensional.mu", mu)).mean_power
        for mu in (key.low95, key.high95)
    ]
    for end in ends:
        assert end.value + end.model == pytest.approx(power.value - power.model, rel=2e-3)


@pytest.mark.thorough("test_formula_finds_the_exact_optimum")
@pytest.mark.slow
def test_weak_coupling_and_a_stop():
    """Passive, r -> 1: E[V^2] of PHYSICS 5.5 by quadrature has its largest mu E[V^2] where `averaged` states."""
    from scipy.integrate import quad
    from scipy.optimize import minimize_scalar

    c = 0.05
    wd = math.sqrt(1.0 - 0.25 * c * c)

    def correlation(s):
        rho = math.exp(-0.5 * c * s) * (math.cos(wd * s) + 0.5 * c / wd * math.sin(wd * s))
        return (
            math.sqrt(max(1.0 - rho * rho, 0.0)) + rho * math.asin(max(min(rho, 1.0), -1.0)) - 1.0
        )

    def power(mu):
        tail = quad(
            lambda s: math.exp(-mu * s) * correlation(s), 0.0, 60.0 / mu, limit=2000, epsabs=1e-7
        )[0]
        return mu * (correlation(0.0) - mu * tail)

    exact = minimize_scalar(
        lambda mu: -power(mu), bounds=(1.0, 4.0), method="bounded", options={"xatol": 1e-3}
    ).x
    weak = systems.scene(systems.changed(systems.linear(1e-4, 1.0, c), restitution=0.9999))
    key = only(hv.optimise(weak, vary=MU, engine=hv.Averaged()))
    assert key.value == pytest.approx(exact, rel=0.01)
    assert key.low95 < exact < key.high95


def test_published_knows_no_interval():
    answer = hv.optimise(LINEAR, vary=MU, engine=hv.Published())
    key = only(answer)
    assert key.value == pytest.approx(math.sqrt(1.0 + BETA), rel=0.03)
    assert (key.low95, key.high95) == (None, None)
    assert "error is not known" in answer.why
    assert "no interval of the keys" in str(answer)


@pytest.mark.thorough("test_formula_finds_the_exact_optimum")
@pytest.mark.slow
def test_two_keys_by_formula(tmp_path):
    """Over mu and beta the linear power grows with beta, and the best mu with it; both are in the figure."""
    answer = hv.optimise(
        LINEAR,
        vary=MU | {"nondimensional.beta": (0.1, 3.0)},
        engine=hv.Averaged(),
        execution=hv.Execution(out=tmp_path),
    )
    mu, beta = answer.keys
    assert (beta.value, beta.boundary, mu.boundary) == (3.0, "high", None)
    assert mu.low95 < 2.0 < mu.high95
    assert "is best at the high end of its range" in str(answer)
    assert (tmp_path / "optimise.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.thorough("test_formula_finds_the_exact_optimum")
@pytest.mark.statistics
def test_two_keys_by_ensemble():
    """mu = sqrt(1 + beta) = 2 at the end of the range of beta, which the power presses against."""
    over = {"nondimensional.mu": (0.3, 12.0), "nondimensional.beta": (0.1, 3.0)}
    answer = hv.optimise(LINEAR, vary=over, engine=dataclasses.replace(ENSEMBLE, trajectories=512))
    mu, beta = answer.keys
    assert (beta.value, beta.high95, beta.boundary) == (3.0, 3.0, "high")
    assert beta.low95 > 2.95
    half = 0.5 * math.log(mu.high95 / mu.low95)
    # 0.25 without controls and with 1024 trajectories
    assert abs(math.log(mu.value / 2.0)) < 2.0 * half < 0.2
    power = answer.mean_power
    assert abs(power.value - linear_power(mu.value, 3.0)) < 4.0 * power.stderr + power.bias


ENSEMBLE = hv.Ensemble(trajectories=1024)


def sampled_search(seed):
    """In a range with even spacing, where the surface is skewed."""
    engine = dataclasses.replace(ENSEMBLE, trajectories=256, seed=seed)
    return hv.optimise(LINEAR, vary={"nondimensional.mu": (0.5, 4.9)}, engine=engine, budget=600.0)


@pytest.fixture(scope="module")
def sampled():
    """The answers of four seeds."""
    return [sampled_search(seed) for seed in range(4)]


@pytest.mark.thorough("test_the_interval_of_a_place")
@pytest.mark.statistics
def test_coverage_of_the_intervals(sampled):
    """The 95 % intervals of the best mu and of the power there hold the exact ones, but for one in four at most.

    In full, 100 seeds each: see the changelog.
    """
    keys, powers = 0, 0
    for answer in sampled:
        key = only(answer)
        power = answer.mean_power
        keys += key.low95 <= math.sqrt(1.0 + BETA) <= key.high95
        powers += abs(power.value - linear_power(key.value)) <= power.known_error95
        assert key.high95 / key.low95 < 1.1
    assert min(keys, powers) >= len(sampled) - 1


@pytest.mark.thorough("test_formula_finds_the_exact_optimum")
@pytest.mark.statistics
def test_intervals_are_no_wider_than_they_must():
    """With synthetic noise, the distance from the true optimum over the stated error scatters like 1, not less."""
    from scipy.optimize import minimize_scalar

    skewed = minimize_scalar(
        lambda u: math.exp(2.0 * u) + math.exp(-0.5 * u), bounds=(-3.0, 3.0), method="bounded"
    ).x
    scores = []
    for seed in range(40):
        key = only(
            hv.optimise(LINEAR, vary=MU, engine=Surface(seed=seed, noise=1.0, shape="skewed"))
        )
        scores.append((math.log(key.value) - skewed) / (math.log(key.high95 / key.low95) / 3.92))
    assert abs(np.mean(scores)) < 4.0 / math.sqrt(40)
    # the standard deviation of 40 scores of 1 has an error of 0.11
    assert 0.5 < np.std(scores) < 1.4


@pytest.mark.statistics
@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_two_peaks(noise):
    """Both are found, the higher one first, wherever the search begins."""
    answer = hv.optimise(LINEAR, vary=MU, engine=Surface(noise=noise))
    assert [math.log(keys["nondimensional.mu"]) for keys, _ in answer.peaks] == pytest.approx(
        [1.5, -1.5], abs=0.05
    )
    for (_, power), height in zip(answer.peaks, (1.1, 1.0), strict=True):
        assert power.value == pytest.approx(height, abs=4.0 * (power.stderr or 0.0) + 1e-3)
    assert only(answer).value == answer.peaks[0][0]["nondimensional.mu"]
    assert "another peak" in str(answer)


@pytest.mark.slow
def test_flat():
    for noise in (0.0, 0.3):
        answer = hv.optimise(LINEAR, vary=MU, engine=Surface(noise=noise, shape="flat"))
        key = only(answer)
        assert (key.low95, key.high95) == MU["nondimensional.mu"]
        assert answer.flat
        assert answer.flat in str(answer)


def test_no_power():
    answer = hv.optimise(LINEAR, vary=MU, engine=Surface(shape="no power"))
    assert "receives no power" in answer.flat
    assert answer.mean_power.value == 0.0


def test_places_that_fail_are_told():
    answer = hv.optimise(LINEAR, vary=MU, engine=Surface(noise=0.1, shape="refuses"))
    assert math.log(only(answer).value) == pytest.approx(-1.5, abs=0.1)
    assert answer.failed > 0
    assert any("evaluations failed, the first: mu is above 1" in str(w) for w in answer.warnings)


def test_all_places_fail():
    with pytest.raises(SimulationError, match="grows without bound"):
        hv.optimise(LINEAR, vary={"nondimensional.c1": (0.5, 1.0)}, engine=hv.Published())


@pytest.mark.statistics
def test_boundary():
    """Above the best mu the power falls: the lower end is best, beyond doubt."""
    key = only(hv.optimise(LINEAR, vary={"nondimensional.mu": (3.0, 20.0)}, engine=ENSEMBLE))
    assert (key.value, key.low95, key.high95, key.boundary) == (3.0, 3.0, 3.0, "low")


@pytest.mark.slow
@pytest.mark.parametrize("engine", [ENSEMBLE, hv.Averaged()], ids=lambda e: e.NAME)
def test_a_budget_too_small(engine):
    """It states the missing parts, and still reports a power with its error."""
    answer = hv.optimise(LINEAR, vary=MU, engine=engine, budget=1e-3)
    key = only(answer)
    assert (key.low95, key.high95) == (None, None)
    assert "budget" in answer.why
    assert answer.is_cut_short
    assert answer.mean_power.known_error95 > 0.0


def test_a_budget_for_one_evaluation_of_two_keys():
    """Both keys have a value: the best place had as many faces as there were evaluations, and the second key none."""
    answer = hv.optimise(
        LINEAR,
        vary=MU | {"nondimensional.beta": (0.3, 0.7)},
        engine=Surface(noise=0.1),
        budget=1e-6,
    )
    assert len(answer.own_points) == 2 and [key.boundary for key in answer.keys] == [None, None]
    assert answer.is_cut_short


def test_runs_of_ngspice_have_what_is_left_of_the_budget(monkeypatch):
    """An evaluation had half a minute at least, and one of a scan any time."""
    found = []

    def run(engine, scene, progress=None):
        found.append(engine.budget)
        return Surface(shape="skewed").run(scene)

    monkeypatch.setattr(hv.Spice, "run", run)
    surface = evaluations.Surface(LINEAR, ranges.ranges(MU), 10.0, share=0.75)
    surface.evaluate(np.array([[0.2], [0.4]]), hv.Spice(), "scan")
    surface.evaluate(np.array([[0.5]]), hv.Spice(budget=1.0), "pilot")
    assert found == [pytest.approx(7.5, abs=0.5)] * 2 + [1.0]
    surface.begin -= 100.0
    assert surface.left_now == pytest.approx(0.1)


@dataclasses.dataclass(frozen=True, kw_only=True)
class CutOff(Surface):
    """As `Surface`, but where mu is above 1 a run is cut off while it still has ten times the power."""

    def run(self, scene, progress=None):
        answer = super().run(scene)
        if Problem.of(scene).scene.nondimensional.mu <= 1.0:
            return answer
        power = Value(10.0 * answer.mean_power.value, unknown="a response that was cut short")
        cut = warning("mean_while_settling", covered=1.0, why="time is over", steady=False)
        return dataclasses.replace(answer, mean_power=power, diagnostics=(cut,))


def test_evaluations_that_were_cut_off_take_no_part():
    """Next to sound ones they are in no fit and never the best, and are reported; the figure counts them."""
    answer = hv.optimise(LINEAR, vary=MU, engine=CutOff(noise=0.1))
    assert math.log(only(answer).value) == pytest.approx(-1.5, abs=0.1)
    assert answer.estimate.is_sound and answer.mean_power.value == pytest.approx(1.0, rel=0.05)
    (said,) = (one for one in answer.warnings if one.code == "evaluations_unsound")
    assert 0 < said.numbers["unsound"] < said.numbers["count"] == len(answer.points)
    assert said.numbers["unsound"] == answer.to_pandas()["is_sound"].value_counts()[False]
    figure = answer.plot(None)
    (legend,) = figure.legends
    told = legend.get_title().get_text().replace("\n", " ")
    assert (
        f"Not drawn: {said.numbers['unsound']} evaluations not settled, cut off or without an error."
        in told
    )


def test_a_short_repr():
    """One line, however many evaluations there were."""
    answer = hv.optimise(LINEAR, vary=MU, engine="exact")
    assert repr(answer).startswith("Optimum(engine='exact', mean_power=") and "\n" not in repr(
        answer
    )
    assert len(answer.to_pandas()) == len(answer.points) == answer.as_json()["evaluations"]
    assert answer.to_xarray().sizes["row"] == len(answer.points)


@pytest.mark.thorough("test_formula_finds_the_exact_optimum")
@pytest.mark.statistics
def test_the_same_seed_the_same_answer(sampled):
    def told(found):
        return only(found).value, found.mean_power.value

    assert told(sampled_search(0)) == told(sampled[0]) != told(sampled[1])


@pytest.mark.thorough("test_formula_finds_the_exact_optimum")
@pytest.mark.statistics
def test_the_power_has_noise_of_its_own(sampled):
    """The seed of the last evaluation took no part in the search: no winner's curse."""
    *search, last = sampled[0].points
    assert last.stage == "optimum"
    assert last.seed not in {p.seed for p in search}


@pytest.mark.slow
def test_command(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(LINEAR.to_toml())
    args = ["optimise", str(scene), "--vary", "nondimensional.mu=0.05:20", "--trajectories", "512"]
    told = CliRunner().invoke(
        cli, [*args, "--json", "--out", str(tmp_path / "out")], catch_exceptions=False
    )
    answer = json.loads(told.stdout)
    key = answer["keys"]["nondimensional.mu"]
    assert key["low95"] < key["value"] < key["high95"]
    assert key["boundary"] is None
    assert {"value", "stderr", "step_bias", "model_bias", "error95"} == set(answer["mean_power"])
    assert answer["evaluations"] == sum(answer["evaluations_by_engine"].values())
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "optimise.csv",
        "optimise.png",
        "provenance.json",
    }
    with (tmp_path / "out" / "optimise.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == answer["evaluations"]
    assert float(rows[-1]["mean_power"]) == pytest.approx(answer["mean_power"]["value"], rel=1e-8)
    assert json.loads((tmp_path / "out" / "provenance.json").read_text())["over"] == {
        "nondimensional.mu": [0.05, 20.0]
    }
    assert (tmp_path / "out" / "optimise.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.thorough("test_runs_of_ngspice_have_what_is_left_of_the_budget")
@pytest.mark.ngspice
@pytest.mark.statistics
def test_spice():
    """ngspice settles where the ensemble led it: few runs, none of a scan."""
    engine = hv.Spice(trajectories=8)
    answer = hv.optimise(
        LINEAR, vary={"nondimensional.mu": (0.2, 6.0)}, engine=engine, within=0.05, budget=600.0
    )
    key = only(answer)
    half = 0.5 * math.log(key.high95 / key.low95)
    assert abs(math.log(key.value / math.sqrt(1.0 + BETA))) < 2.0 * half
    assert answer.evaluations["spice"] <= 40
    assert {p.stage for p in answer.points if p.engine == "spice"} <= {
        "pilot",
        "climb",
        "box",
        "optimum",
    }
