"""Many scenes side by side: each has the answer that it has alone."""

import inspect

import numpy as np
import pytest

import harvester as hv
from harvester.engines.many_designs import many_at_once
from harvester.equations.problem import Problem
from harvester.errors import HarvesterError
from harvester.mechanics.kernels.coefficients import Coefficients, coefficients

WHITE = {"c1": -0.05, "beta": 0.05, "mu": 1.0, "D11": 0.01}
SCENES = {
    "stop": WHITE | {"restitution": 0.9},
    "strong impacts": WHITE | {"restitution": 0.3},
    "strong impacts, samples of 34 steps": WHITE | {"restitution": 0.3, "beta": 0.15},
    "hardening": WHITE | {"alpha": 3.0, "D11": 0.5},
    "linear, open": {"c1": -0.1, "D11": 0.01},
    "parametric": WHITE | {"D22": 0.01, "eps2": 0.5},
    "gap": WHITE | {"restitution": 0.8, "gap": 0.1},
    "two stops": WHITE
    | {"restitution": 0.9, "gap": 0.2, "opposite_restitution": 0.8, "opposite_gap": 0.3},
    "compliant stop": WHITE | {"stop_stiffness": 20.0, "stop_damping": 0.5, "gap": 0.1},
    "two wells": WHITE | {"linear": -1.0, "alpha": 1.0, "D11": 0.5},
    "skewed spring": WHITE | {"alpha": 0.5, "alpha2": 0.2, "D11": 0.1},
    "friction": WHITE | {"c2": -0.1, "c3": 0.05, "cv": 0.05},
    "correlated noise": WHITE | {"D22": 0.01, "D12": 0.005},
    "ceramic": WHITE | {"softening": 0.2, "alpha": 0.5, "loss_tangent": 0.1},
    "growing coefficients": WHITE | {"inertia": 0.3, "gamma": 0.2},
}


def scene(**table):
    return hv.Scene(nondimensional=hv.Nondimensional(**table))


def same_as_alone(engine, scenes, seeds):
    """Compare each scene's answer with that of the scene alone, by the same seed."""
    together = engine.run_many(scenes, seeds)
    for one, seed, answer in zip(scenes, seeds, together, strict=True):
        alone = engine.with_seed(seed).run(one)
        assert answer.steps == alone.steps
        for name in ("mean_power", "mean_square_voltage"):
            mine, its = getattr(answer, name), getattr(alone, name)
            assert mine.value == pytest.approx(its.value, rel=1e-5, abs=1e-30)
            assert mine.stderr == pytest.approx(its.stderr, rel=1e-3, abs=1e-30)
            assert mine.bias == pytest.approx(its.bias, rel=1e-2, abs=1e-5 * abs(its.value))
        codes = [d.code for d in alone.diagnostics]
        assert [d.code for d in answer.diagnostics] == codes
        for name in ("step", "burn_in", "duration", "trajectories"):
            assert answer.details[name] == pytest.approx(alone.details[name])
        for name in (name for name in alone.details if name.startswith("power_balance")):
            assert answer.details[name] == pytest.approx(alone.details[name], rel=1e-2, abs=1e-5)
        assert answer.details.keys() == alone.details.keys()


@pytest.mark.parametrize("name", SCENES)
def test_as_alone(name):
    """The burn-in, the steps that a target asks for, and the errors are those of the scene alone."""
    scenes = [scene(**SCENES[name] | {"c1": c1}) for c1 in (-0.04, -0.1, -0.3)]
    same_as_alone(hv.Ensemble(within="2%"), scenes, [3, 4, 5])


def test_every_coefficient_is_in_a_scene():
    """A coefficient that the kernels gain is in one of `SCENES`, which `test_as_alone` compares."""
    known = [coefficients(Problem(scene(**table)).equations) for table in SCENES.values()]
    names = inspect.signature(Coefficients).parameters
    missing = [name for name in names if all(getattr(one, name) is None for one in known)]
    assert not missing
    assert {"dielectric_loss"} <= {
        name for table in SCENES.values() for name in Problem(scene(**table)).effects
    }
    assert all(
        many_at_once(hv.Ensemble(), Problem(scene(**table))) > 1 for table in SCENES.values()
    )


@pytest.mark.slow
def test_unlike_scenes_in_one_call():
    """Scenes of other effects, and such that nobody runs side by side, are answered in their places."""
    tables = [
        SCENES["stop"],
        SCENES["hardening"],
        WHITE | {"alpha": 0.2, "linear": -1.0, "alpha2": 0.1},
    ]
    tables += [{"c1": 0.1, "beta": 0.05, "mu": 1.0, "D11": 0.01}, SCENES["stop"] | {"mu": 0.1}]
    scenes = [scene(**table) for table in tables]
    answers = hv.Ensemble(within="5%").run_many(scenes)
    assert isinstance(answers[3], HarvesterError)
    alone = hv.Ensemble(within="5%").run(scenes[4])
    assert answers[4].mean_power.value == pytest.approx(alone.mean_power.value, rel=1e-5)


@pytest.mark.parametrize("netlist", ["bridge", "parallel_sshi"])
def test_ideal_circuits(netlist):
    """Circuits of ideal elements run side by side without the reference of each point."""
    load = hv.Load(netlist=netlist, parameters={"R": "1 Mohm", "C": "20 nF"})
    plate = hv.load("examples/plate_with_stop.toml").with_load(load)
    scenes = [plate.varied({"load.parameters.R": r}) for r in (3e5, 1e6)]
    engine = hv.Ideal(within="3%")
    assert many_at_once(engine, Problem(plate)) == 1
    assert many_at_once(engine.at_many_points, Problem(plate)) > 1
    same_as_alone(engine.at_many_points, scenes, [1, 2])


def test_who_runs_side_by_side():
    """No batch for a budget, a fixed step, several wells or a steady excitation."""
    problem = Problem(scene(**SCENES["stop"]))
    assert many_at_once(hv.Ensemble(within="1%"), problem) == 64
    assert many_at_once(hv.Ensemble(), problem) == 2
    assert many_at_once(hv.Ensemble(within="1%", budget=3.0), problem) == 1
    assert many_at_once(hv.Ensemble(within="1%", dt=0.1), problem) == 1
    wells = Problem(scene(**WHITE | {"alpha": 1.0, "linear": -1.0, "alpha2": 0.1}))
    assert many_at_once(hv.Ensemble(within="1%"), wells) == 1


def test_answers_do_not_depend_on_the_batch():
    """A scene's answer is the same next to others and in a batch of its own."""
    scenes = [scene(**SCENES["stop"] | {"mu": mu}) for mu in (0.1, 0.5, 2.0)]
    engine = hv.Ensemble(within="1%")
    together = engine.run_many(scenes, [7, 8, 9])
    (alone,) = engine.run_many(scenes[1:2], [8])
    assert alone.mean_power.value == pytest.approx(together[1].mean_power.value, rel=1e-12)


def test_spread_of_independent_seeds():
    """The stated errors are those of answers by independent noise: z of 64 pairs."""
    scenes = [scene(**SCENES["stop"] | {"mu": mu}) for mu in np.geomspace(0.1, 2.0, 64)]
    engine = hv.Ensemble(within="2%")
    first, second = engine.run_many(scenes, range(64)), engine.run_many(scenes, range(100, 164))
    z = np.array(
        [
            (a.mean_power.value - b.mean_power.value)
            / np.hypot(a.mean_power.stderr, b.mean_power.stderr)
            for a, b in zip(first, second, strict=True)
        ]
    )
    assert np.abs(z).max() < 4.0
    assert abs(z.mean()) * np.sqrt(len(z)) < 4.0
    assert abs(z.std() - 1.0) < 4.0 * np.sqrt(0.5 / len(z))
