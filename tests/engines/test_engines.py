"""Engines end to end: exact answers, errors that are true, refusals that name another engine."""

import json
import math
import time

import numpy as np
import pytest

import harvester as hv
from harvester.engines.selection import check_engine, default_engine, default_engines
from harvester.engines.spice.setup import set_up
from harvester.equations.bounds import check_bounded
from harvester.equations.problem import Problem
from harvester.errors import (
    CannotServeError,
    InputError,
    MissingProgramError,
    UnboundedResponseError,
)
from harvester.presentation.diagnostic import has
from harvester.studies.compare import compare
from harvester.studies.stability.exponent import stability
from harvester.uncertainty.value import Value, z_score
from tests.support.systems import PAPER, PAPER_V2, changed, linear, linear_v2, scene, z

PLATE = hv.load("examples/plate.toml")
OPEN = scene(changed(linear(None, None, c=0.1), restitution=0.9))


def pair(value):
    return value.value, value.stderr


@pytest.mark.thorough("test_paper_scene_in_spice")
@pytest.mark.ngspice
@pytest.mark.statistics
@pytest.mark.parametrize("beta, mu", [(1.25, 0.05), (0.05, 1.0), (1.25, 5.0)])
def test_linear_scene_in_spice_and_ensemble(beta, mu):
    """E[V^2] and E[P], |z| < 4 with a standard error under 1 %, both engines."""
    eqs = linear(beta, mu)
    exact = linear_v2(eqs)
    for engine in (hv.Ensemble(within=0.01), hv.Spice(within=0.01, trajectories=8, seed=3)):
        answer = engine.run(scene(eqs))
        assert answer.mean_square_voltage.stderr < 0.01 * exact
        error = math.hypot(answer.mean_square_voltage.stderr, answer.mean_square_voltage.bias)
        assert abs(z((answer.mean_square_voltage.value, error), exact)) < 4
        assert abs(z((answer.mean_power.value, beta * mu * error), beta * mu * exact)) < 4


@pytest.mark.ngspice
@pytest.mark.statistics
def test_paper_scene_in_spice():
    """E[V^2] = 0.0881 within 1 %, and the power balance, in ngspice: a few runs beside the cheap model tell half."""
    answer = hv.Spice(within=0.01, seed=3).run(scene(PAPER))
    value, error = pair(answer.mean_square_voltage)
    assert error < 0.005 * value
    assert answer.mean_power.known_error95 <= 0.01 * answer.mean_power.value
    assert abs(z((value, math.hypot(error, answer.mean_square_voltage.bias)), *PAPER_V2)) < 4
    assert value == pytest.approx(0.0881, rel=0.01)
    assert (
        abs(z((answer.details["power_balance"], answer.details["power_balance_stderr"]), 0.0)) < 4
    )


@pytest.mark.thorough("test_paper_scene_in_spice")
@pytest.mark.ngspice
def test_identities_in_spice():
    """E[V] = 0, E[xV] = E[V^2], E[x'V] = mu E[V^2], path by path, in ngspice."""
    from harvester.cosimulation import runs as worker
    from harvester.uncertainty.value import mean_and_error

    for eqs in (PAPER, changed(linear(1.25, 1.0), restitution=0.96)):
        device = set_up(Problem(scene(eqs)), hv.Spice(dt=0.05)).device
        seeds = [np.random.SeedSequence([5, k]) for k in range(16)]
        runs = list(worker.measure_in_workers(device, seeds, n_steps=16_000, burn_in=400.0))
        moments = runs[0].moments
        for one in runs[1:]:
            moments = moments + one.moments
        v2 = moments.V2.mean()
        for values in (moments.V, moments.vV - eqs.mu * moments.V2):
            assert abs(z(mean_and_error(values), 0.0)) < 4
        difference, error = mean_and_error(moments.xV - moments.V2)
        # holds path by path: the step's bias is the remainder
        assert abs(difference) < 4 * error + 1e-3 * v2
        assert abs(z(mean_and_error(moments.balance(eqs)), 0.0)) < 4


@pytest.mark.slow
def test_strong_impacts_leave_the_step_in_the_power_balance():
    """It is stated, falls with the step, and with the sampling error covers the deviation of the balance."""
    strong = scene(changed(PAPER, restitution=0.37))
    default, quarter = (
        hv.Ensemble(dt=dt, trajectories=8192, duration=150.0).run(strong).details
        for dt in (0.0976, 0.0244)
    )
    # both parts, which have opposite signs here
    assert default["power_balance_bias"] == pytest.approx(2.6e-3, rel=0.4)
    assert quarter["power_balance_bias"] < 0.5 * default["power_balance_bias"]
    for found in (default, quarter):
        assert (
            abs(found["power_balance"])
            < 4 * found["power_balance_stderr"] + found["power_balance_bias"]
        )


def test_published_is_four_times_too_high_with_the_stop():
    published = hv.Published().run(scene(PAPER))
    assert published.mean_square_voltage.value == pytest.approx(0.352, rel=0.01)
    assert published.mean_square_voltage.stderr is None
    assert published.mean_square_voltage.value / PAPER_V2[0] == pytest.approx(4.0, rel=0.02)
    assert "too high" in str(published.warnings[0])


def test_published_is_no_such_thing_in_open_circuit():
    """V begins with x there and keeps that mean, which the harmonic V has as well: 4 % above the ensemble's 0.3523."""
    published = hv.Published().run(scene(changed(PAPER, mu=None)))
    assert published.mean_square_voltage.value == pytest.approx(0.3523, rel=0.05)
    assert "variance of V about that mean" in str(published.warnings[0])
    assert "too high" not in str(published.warnings[0])
    assert not hv.Published().run(PLATE).warnings


def test_units_of_a_physical_scene():
    """E[P] = E[v^2]/R in SI, and both match the nondimensional numbers."""
    answer = hv.Ensemble(trajectories=256).run(PLATE)
    assert answer.mean_power.value == pytest.approx(
        answer.mean_square_voltage.value / 1e6, rel=1e-12
    )
    nd = answer.nondimensional
    assert nd["mean_power"] == pytest.approx(
        nd["beta"] * nd["mu"] * nd["mean_square_voltage"], rel=1e-12
    )
    assert (nd["beta"], nd["mu"]) == pytest.approx(
        (1e-6 / (16 * 50.2e-9), 1 / (1e6 * 50.2e-9 * 20))
    )
    psd = 1e-5 * 9.80665**2
    assert answer.mean_power.value < 0.04 * psd / 4  # all that white noise can put in: M G/4


@pytest.mark.parametrize(
    "given", [PLATE, scene(changed(PAPER, beta=0.3, mu=0.7))], ids=["plate", "paper"]
)
def test_samples_have_the_means_that_are_answered(given):
    """V^2 is nondimensional, the power in the scene's unit, one for each trajectory."""
    answer = hv.Ensemble(trajectories=256, duration=20.0 if given is PLATE else 200.0).run(given)
    assert len(answer.samples) == len(answer.power_samples) == 256
    assert answer.power_samples.mean() == pytest.approx(answer.mean_power.value, rel=1e-12)
    assert answer.samples.mean() == pytest.approx(
        answer.nondimensional["mean_square_voltage"], rel=1e-12
    )


@pytest.mark.ngspice
def test_power_of_the_load_resistor_in_ngspice_is_v_squared_over_r():
    """ngspice's own power of Rload, through the load-power path of netlists, against E[v^2]/R."""
    from harvester.cosimulation import runs as worker

    device = set_up(Problem(PLATE), hv.Spice()).device
    one = next(worker.measure_in_workers(device, [np.random.SeedSequence(4)], 40_000, 300.0))
    s, eqs = device.scales, device.eqs
    assert one.load_power == pytest.approx(
        s.watts * eqs.beta * eqs.mu * one.moments.V2[0], rel=0.01
    )


@pytest.mark.thorough("test_paper_scene_in_spice")
@pytest.mark.ngspice
@pytest.mark.parametrize(
    "engine",
    [hv.Ensemble(trajectories=512, seed=5), hv.Spice(trajectories=2, duration=5.0, seed=5)],
)
def test_same_seed_same_answer(engine):
    a, b = engine.run(PLATE), engine.run(PLATE)
    assert a.mean_power == b.mean_power
    assert a.steps == b.steps > 0


@pytest.mark.statistics
def test_within_is_reached_and_told():
    answer = hv.Ensemble(within=0.003).run(scene(PAPER))
    assert answer.mean_power.known_error95 <= 0.003 * answer.mean_power.value
    short = hv.Ensemble(within=1e-5, budget=0.3).run(scene(PAPER))
    assert "was not reached" in str(short.warnings[-1])


def test_the_variance_of_an_open_circuit_is_doubted_only_there():
    """`averaged` warns at a stop without a load, but not with a load or without a stop."""
    doubts = {
        name: has(hv.Averaged().run(scene(eqs)).warnings, "open_circuit_variance")
        for name, eqs in {
            "open with a stop": changed(PAPER, mu=None, beta=None),
            "loaded with a stop": PAPER,
            "linear": linear(0.05, 1.0),
        }.items()
    }
    assert doubts == {"open with a stop": True, "loaded with a stop": False, "linear": False}


BRIDGE = PLATE.with_load(hv.Load(netlist="bridge", parameters={"R": "1 Mohm", "C": "0.3 uF"}))


@pytest.mark.ngspice
def test_netlist_load():
    answer = hv.Spice(trajectories=8, duration=10.0).run(BRIDGE)
    assert "netlist" in answer.effects
    assert 0 < answer.mean_power.value < 0.04 * 1e-5 * 9.80665**2 / 4
    assert 0.0 < answer.mean_power.bias < 0.01 * answer.mean_power.value
    assert "circuit without ngspice" in answer.reason
    assert answer.details["duration"] == pytest.approx(10.0, rel=0.01)
    for engine in (hv.Published(), hv.Ensemble()):
        with pytest.raises(CannotServeError, match="use engine 'spice'"):
            engine.run(BRIDGE)


@pytest.mark.ngspice
def test_a_netlist_of_ones_own(tmp_path):
    """The same circuit, compiled, is next to it and gives the bias of the step; no ideal one supports it."""
    own = tmp_path / "own.cir"
    own.write_text(".subckt own p n R=1Meg\nRload p n {R}\nR2 p n 1G\n.ends\n")
    answer = hv.Spice(trajectories=2, duration=2.0).run(PLATE.with_load(hv.Load(netlist=str(own))))
    assert 0.0 < answer.mean_power.bias < 0.01 * answer.mean_power.value
    with pytest.raises(CannotServeError, match="use engine 'spice'"):
        hv.Ideal().run(PLATE.with_load(hv.Load(netlist=str(own))))
    with pytest.raises(CannotServeError, match="use engine 'ensemble'"):
        hv.Ideal().run(PLATE)
    same = hv.Spice(trajectories=8, duration=10.0).run(
        PLATE.with_load(hv.Load(netlist="resistor", parameters={"R": "1 Mohm"}))
    )
    assert abs(z_score(same.mean_power, hv.Ensemble().run(PLATE).mean_power)) < 4


@pytest.mark.thorough("test_paper_scene_in_spice")
@pytest.mark.ngspice
@pytest.mark.parametrize(
    "given", [hv.load("examples/plate_with_stop.toml"), BRIDGE], ids=["stop", "bridge"]
)
def test_paired_and_alone_agree(given):
    """The control variate changes the error, not the mean."""
    paired = hv.Spice(seed=4, trajectories=8, duration=10.0).run(given)
    alone = hv.Spice(seed=5, alone=True, trajectories=8, duration=30.0).run(given)
    assert abs(z_score(paired.mean_power, alone.mean_power)) < 4
    assert abs(z_score(paired.mean_square_voltage, alone.mean_square_voltage)) < 4
    assert paired.mean_power.stderr < 0.3 * alone.mean_power.stderr
    assert paired.details["control_correlation"] > 0.99


@pytest.mark.thorough("test_both_noise_modes_have_the_same_law")
@pytest.mark.ngspice
def test_gaussian_and_three_point_noise_agree():
    """Weak order 2 sees only the moments that both have."""
    some = {"alone": True, "trajectories": 8, "duration": 60.0}
    three = hv.Spice(seed=6, **some).run(PLATE)
    gaussian = hv.Spice(seed=7, gaussian=True, **some).run(PLATE)
    assert abs(z_score(three.mean_power, gaussian.mean_power)) < 4
    with pytest.raises(InputError, match="alone"):
        hv.Spice(gaussian=True)


@pytest.mark.ngspice
@pytest.mark.statistics
def test_the_cheapest_engine():
    """`averaged` where its own error allows it, `ensemble` where not, `spice` for a netlist; and why."""
    paper = scene(PAPER)
    quick = hv.Cheapest(within=0.01).run(paper)
    assert (quick.engine, quick.seconds < 1.0) == ("averaged", True)
    assert quick.mean_power.model < 0.01 * quick.mean_power.value
    within = 0.9 * quick.mean_power.known_error95 / quick.mean_power.value
    fine = hv.Cheapest(within=within).run(paper)
    assert fine.engine == "ensemble"
    assert "states an error of" in fine.reason
    assert fine.mean_power.known_error95 <= within * fine.mean_power.value
    unaveraged = hv.Cheapest(within=0.05).run(hv.load("examples/plate_compliant_stop.toml"))
    assert unaveraged.engine == "ensemble"
    netlist = hv.Cheapest(within=0.05).run(BRIDGE)
    assert netlist.engine == "spice"
    assert netlist.mean_power.known_error95 <= 0.05 * netlist.mean_power.value
    with pytest.raises(InputError, match="`within`"):
        hv.Cheapest().run(paper)


def test_refusals(monkeypatch):
    with pytest.raises(CannotServeError, match="use engine 'ensemble'"):
        hv.Spice().run(scene(changed(PAPER, mu=None)))
    with pytest.raises(UnboundedResponseError):
        hv.Ensemble().run(scene(changed(PAPER, c3=None)))
    with pytest.raises(InputError, match="`trajectories`"):
        hv.Ensemble(trajectories=0)
    monkeypatch.setenv("NGSPICE_LIBRARY_PATH", "/nonexistent/libngspice.so")
    with pytest.raises(MissingProgramError, match="unset NGSPICE_LIBRARY_PATH"):
        hv.Spice().run(PLATE)


def test_every_answer_warns_of_values_that_no_device_has():
    assert hv.Averaged().run(PLATE).warnings == ()
    (word,) = hv.Averaged().run(PLATE.vary("piezo.capacitance", 50.0)).warnings
    assert str(word).endswith("F: is 50 nF meant?")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "name", "refusing"),
    [
        ({"gap": 0.2}, "gap", {"published"}),
        (
            {"gap": 0.2, "opposite_restitution": 1.0, "opposite_gap": 1.0},
            "gap and opposite stop",
            {"published"},
        ),
        (
            {"opposite_restitution": 1.0, "opposite_gap": 1.0},
            "opposite stop",
            {"published", "averaged"},
        ),
        ({"restitution": None, "stop_stiffness": 1e3}, "compliant stop", {"published", "averaged"}),
        ({"linear": -1.0}, "negative stiffness", {"published", "averaged"}),
        ({"alpha2": 0.3}, "quadratic stiffness", {"published", "averaged"}),
        (
            {"alpha": -0.3, "opposite_restitution": 1.0, "opposite_gap": 1.0},
            "softening stiffness and opposite stop",
            {"published", "averaged"},
        ),
    ],
)
def test_what_an_engine_does_not_know_is_refused_by_name(changes, name, refusing):
    """By those that do not, naming one that does; the ensemble supports everything; the effects are named."""
    problem = Problem(given := scene(changed(PAPER, **changes)))
    for engine in refusing:
        with pytest.raises(
            CannotServeError,
            match=f"^engine '{engine}' cannot model .*{name}: use engine 'ensemble'",
        ):
            hv.engines.engine(engine).run(given)
    assert not hv.Ensemble.refusal(problem)
    assert set(name.replace(" ", "_").split("_and_")) <= set(problem.effects)


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"restitution": 0.9}, "impact"),
        ({"restitution": 0.9, "gap": 0.5, "alpha": 0.1}, "cubic stiffness and impact and gap"),
        ({"stop_stiffness": 100.0}, "compliant stop"),
        ({"alpha": -0.1}, "softening stiffness"),
        (
            {"alpha2": 0.1, "c2": -0.1, "c3": 0.1},
            "quadratic stiffness and damping_x2 and damping_x4",
        ),
    ],
)
def test_exact_says_what_is_not_linear(changes, name):
    with pytest.raises(CannotServeError) as told:
        hv.Exact().run(scene(changed(linear(0.05, 1.0), **changes)))
    assert (
        str(told.value)
        == f"engine 'exact', for linear equations, cannot model {name}: use engine 'ensemble'"
    )


def test_the_default_engine():
    """`exact` for a linear scene, unless the options are those of sampling."""
    assert (
        default_engine(PLATE)
        == default_engine(PLATE, seed=3, budget=1.0, trajectories=None)
        == "exact"
    )
    assert default_engine(PLATE, trajectories=64) == default_engine(scene(PAPER)) == "ensemble"
    assert default_engine(BRIDGE) == default_engine(BRIDGE, dt=1e-3) == "spice"
    assert default_engine(PLATE, within=0.01, dt=1e-3) == "cheapest"
    assert (default_engines(PLATE), default_engines(BRIDGE)) == (["exact"], ["ideal", "spice"])
    assert default_engines(scene(PAPER)) == ["published", "averaged", "ensemble"]
    assert check_engine(scene(PAPER)) == hv.Density()
    assert check_engine(PLATE) is None
    chosen = hv.run(PLATE, within="1%")
    assert chosen.reason.startswith("engine 'exact' was chosen as the cheapest: its stated error, ")
    assert chosen.mean_power == hv.run(PLATE).mean_power
    with pytest.raises(UnboundedResponseError):
        hv.run(PLATE.vary("oscillator.damping", -1.0), within="1%")


def test_engines_that_serve_a_scene():
    """Formulas are not tried where they would refuse; the exact one comes first."""
    assert hv.engines.serving(PLATE) == [
        "exact",
        "published",
        "averaged",
        "density",
        "ensemble",
        "spice",
    ]
    assert hv.engines.serving(hv.load("examples/plate_preloaded.toml")) == [
        "averaged",
        "density",
        "ensemble",
        "spice",
    ]
    assert hv.engines.serving(hv.load("examples/plate_harmonic.toml")) == [
        "exact",
        "ensemble",
        "spice",
    ]


@pytest.mark.parametrize(
    ("changes", "side"),
    [
        ({"restitution": None, "alpha": -0.1}, "above"),
        ({"alpha": -0.1}, "above"),
        ({"alpha": None, "alpha2": -0.1}, "above"),
        ({"restitution": None, "alpha": None, "alpha2": 0.1}, "below"),
        ({"restitution": None, "alpha": None, "linear": -1.0}, "above"),
        ({"alpha": None, "alpha2": 0.1, "restitution": None, "stop_stiffness": 1e3}, "below"),
    ],
    ids=str,
)
def test_a_spring_that_pushes_the_mass_away_is_refused(changes, side):
    with pytest.raises(
        UnboundedResponseError,
        match=f"far {side} rest the spring pushes .*; give a cubic_stiffness above",
    ):
        hv.Ensemble().run(scene(changed(PAPER, **changes)))
    check_bounded(changed(PAPER, alpha=None, alpha2=0.1, restitution=0.9))


@pytest.mark.statistics
def test_stability_is_that_of_rest_at_zero():
    for changes in ({"gap": 0.2}, {"linear": -1.0}, {"restitution": None, "stop_stiffness": 1e3}):
        with pytest.raises(CannotServeError, match=r"^stability, of rest at x = 0 .* cannot model"):
            stability(scene(changed(PAPER, **changes)))
    quadratic = stability(scene(changed(PAPER, alpha2=0.3)), trajectories=64, duration=50.0)
    assert quadratic.ensemble == stability(scene(PAPER), trajectories=64, duration=50.0).ensemble


@pytest.mark.thorough("test_comparison_has_every_engine_and_its_z")
@pytest.mark.ngspice
def test_compare_draws_no_path_where_the_decoupled_voltage_has_no_meaning():
    compared = compare(scene(changed(PAPER, gap=0.3, c1=-0.3)), trajectories=4, duration=5.0)
    assert {e.engine for e in compared.estimates} == {"averaged", "density", "ensemble", "spice"}
    assert set(compared.refused) == {"exact", "published"}
    assert compared.paths == ()


def test_json_is_the_contract():
    answer = hv.Ensemble(trajectories=128, duration=50.0).run(scene(PAPER))
    told = json.loads(json.dumps(answer.as_json(), allow_nan=False))
    assert told["engine"] == "ensemble"
    assert set(told["mean_power"]) >= {"value", "stderr"}
    assert set(told["nondimensional"]) >= {"mean_square_voltage", "mean_power", "beta", "mu"}
    assert {"cubic_stiffness", "impact"} <= set(told["effects"])
    assert isinstance(told["steps"], int)
    assert isinstance(told["seconds"], float)
    assert told["warnings"] == []


def test_text_carries_its_errors():
    text = str(hv.Ensemble(trajectories=128).run(PLATE))
    assert "95 %, sampling" in text
    assert "(step) uW" in text
    assert "no sampling error" in str(hv.Published().run(PLATE))
    assert Value(0.0, 0.0).format("W") == "0 +- 0 (95 %, sampling) W"
    assert z_score(Value(1.0, 0.3), Value(0.5, 0.4)) == pytest.approx(1.0)
    assert z_score(Value(1.0, 0.3, bias=1.96), Value(0.5, 0.0)) == pytest.approx(
        0.5 / 1.3
    )  # with what is stated of the step
    assert z_score(Value(1.0), Value(0.5)) is None
    assert z_score(Value(1.0, 0.3, unknown="the step"), Value(0.5, 0.1)) is None


@pytest.mark.thorough("test_units_of_a_physical_scene")
def test_scenes_without_load_or_noise():
    opened = hv.Ensemble(trajectories=128).run(OPEN)
    assert opened.mean_power.value == 0.0
    assert "open circuit" in str(opened.warnings[-1])
    quiet = hv.Ensemble(trajectories=64).run(scene(changed(linear(0.05, 1.0), n1=None)))
    assert quiet.mean_power.value < 1e-10
    assert "dies out" in str(quiet.warnings[0])


def test_a_formula_says_where_it_is_not_within():
    """--within on a formula: silent if its stated error is smaller, else a warning; published never knows."""
    told = "cannot be guaranteed"
    assert not any(told in str(w) for w in hv.Averaged(within=0.01).run(scene(PAPER)).warnings)
    assert any(told in str(w) for w in hv.Averaged(within=0.001).run(scene(PAPER)).warnings)
    assert any(
        "is not known" in str(w) for w in hv.Published(within=0.5).run(scene(PAPER)).warnings
    )


def test_a_mass_that_does_not_move_takes_no_power():
    """Held on a stop: the balance of power is zeros, no nan (which --json cannot state)."""
    held = changed(
        linear(0.05, 1.0),
        n1=None,
        c1=-0.5,
        restitution=0.3,
        gap=-1.0,
        drive=0.01,
        drive_frequency=1.0,
    )
    answer = hv.Ensemble(trajectories=64, duration=10.0, within=0.05).run(scene(held))
    assert answer.mean_power.value == 0.0
    assert (answer.details["power_balance"], answer.details["power_balance_stderr"]) == (0.0, 0.0)


def test_a_theory_names_exact_for_a_linear_scene():
    """It is the default there, and has no error but rounding; not if the scene is not linear."""
    driven = scene(changed(linear(0.05, 1.0), drive=1.0, drive_frequency=1.0))
    assert not hv.Exact.refusal(Problem(driven))
    assert str(hv.Averaged.refusal(Problem(driven))).endswith(
        "use engine 'ensemble', or 'exact', which supports all linear scenes"
    )
    stopped = scene(changed(linear(0.05, 1.0), drive=1.0, drive_frequency=1.0, restitution=0.9))
    assert str(hv.Averaged.refusal(Problem(stopped))).endswith("use engine 'ensemble'")


@pytest.mark.slow
def test_a_large_storage_capacitor_is_named_as_the_cause():
    """R C = 10,000 s is not forgotten within a budget of seconds."""
    load = hv.Load(netlist="bridge", parameters={"R": "10M", "C": "1mF"})
    with pytest.raises(
        hv.SimulationError, match=r"the cause is the time constant R C = 1e\+04 s, where w0"
    ):
        hv.Ideal(trajectories=64, budget="1s").run(PLATE.with_load(load))


@pytest.mark.parametrize(
    "engine", [hv.Ideal, hv.Compiled, pytest.param(hv.Spice, marks=pytest.mark.ngspice)]
)
def test_a_coupling_that_asks_for_too_short_a_step_is_refused_at_once(engine):
    """382 N/V, a slip of the prefix: the first steps of the circuit, before any burn-in, lasted
    minutes in any budget."""
    bridge = hv.Load(netlist="bridge", parameters={"R": "1M", "C": "10uF"})
    strong = PLATE.replace(load=bridge).vary("piezo.coupling", 382.0)
    begin = time.process_time()
    with pytest.raises(
        hv.SimulationError, match=r"trajectory-steps of 2\.3e-07/w0: give a longer `dt`"
    ):
        engine(budget="5s").run(strong)
    assert time.process_time() - begin < 15.0


def test_open_circuit_with_a_stop_is_the_variance():
    """`averaged` leaves out the mean that V keeps from its start, and states so; `ensemble` reports both together."""
    found = hv.Averaged().run(OPEN)
    many = hv.Ensemble(trajectories=1024).run(OPEN)
    assert any(
        str(one).startswith("open circuit: this is the variance of V") for one in found.warnings
    )
    mean = many.mean_square_voltage.value - found.mean_square_voltage.value
    assert mean > found.mean_square_voltage.value
