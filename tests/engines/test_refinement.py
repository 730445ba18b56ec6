"""Responses at smaller steps until the error is small enough: for a load of one's own as for those of the engines."""

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.engines.compiled_steady import CompiledPeriods
from harvester.engines.refinement import FEWEST_STEPS, Refinement
from harvester.engines.spice.steady_response import to_be_found
from harvester.equations.problem import Problem
from harvester.netlists.for_ngspice import RELTOL
from tests.support.resistor_map import ResistorMap


@dataclass(frozen=True)
class Response:
    power: float
    square: float
    left: tuple[float, float]


class ResistorPeriods(Refinement):
    """The responses of the map of a resistor, as far as ``settles`` halvings of the step."""

    def __init__(self, problem, settles=math.inf, **settings):
        super().__init__(**settings)
        self.problem = problem
        self.settles = settles
        self.responses[0, 0] = next(self.responses_at([(0, 0)]))

    def responses_at(self, settings):
        for halvings, _ in settings:
            period = self.problem.equations.shaking_period
            path = ResistorMap(self.problem, period / (FEWEST_STEPS * 2**halvings))
            settled = path.settling(1)
            if halvings > self.settles or not settled.reach(self.enough):
                yield None
                return
            state, means = path.turn(settled.state, 1)
            rest = settled.remainder(state - settled.state)
            yield Response(means[0], means[1], tuple(rest.shares(means)[:2]))


@pytest.fixture
def problem():
    return Problem.of(hv.load("examples/plate_harmonic.toml").with_load(resistance=1e6))


@pytest.mark.parametrize("within", [1e-3, 1e-5])
def test_a_load_of_ones_own_is_refined_to_the_closed_form(problem, within):
    found = ResistorPeriods(problem, halvings=6, within=within)
    found.make_precise()
    power = hv.Exact().run(problem.scene).mean_power.value
    value, error = found.errors("power")
    assert found.unknown is None
    assert abs(value - power) < error.total < within * power
    assert error.tolerance == 0.0


def test_without_a_finer_response_the_error_is_that_of_the_steps_there_are(problem):
    """Too few of them leave it unknown."""
    found, short = (
        ResistorPeriods(problem, settles, halvings=6, within=1e-9) for settles in (3, 1)
    )
    found.make_precise()
    assert found.unknown is None
    assert found.finest == 3
    power = hv.Exact().run(problem.scene).mean_power.value
    value, error = found.errors("power")
    assert abs(value - power) < error.total
    short.make_precise()
    assert short.unknown is not None
    assert short.unknown.code == "precision_unknown"


def compiled(problem):
    circuit = compiled_circuit(problem.load_circuit, problem.scales)
    eqs = problem.equations
    return CompiledPeriods(halvings=4, circuit=circuit, eqs=eqs, h=eqs.shaking_period / 64)


def by_ngspice(problem):
    return to_be_found(hv.Spice(), problem, RELTOL)


@pytest.mark.parametrize("kind", [compiled, by_ngspice])
@pytest.mark.parametrize("name", ["power", "square"])
def test_the_error_of_settling_bounds_all_that_is_left_at_each_step(problem, kind, name):
    """If E_h = 1 + h^2 is off by ``left`` with any sign, (4 E_h - E_2h)/3 is off by up to 5/3 of it."""
    left = 1e-3
    bridge = Problem.of(problem.scene.with_load(netlist="bridge", parameters={"R": "1 Mohm"}))
    found = kind(bridge)
    worst = 0.0
    for signs in product((-1.0, 1.0), repeat=3):
        means = (1.0 + np.array([0.4, 0.2, 0.1]) ** 2) * (1.0 + left * np.array(signs))
        found.responses = {
            (k, 0): Response(mean, mean, (left, left)) for k, mean in enumerate(means)
        }
        worst = max(worst, abs(found.value(name).value - 1.0))
        assert worst <= (1.0 + 2.0 * left) * found.errors(name)[1].settling
    assert worst > 1.6 * left
