"""A step that nobody chose is made smaller where ngspice does not converge with it, then a little capacitance helps."""

import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.errors import CircuitError, ConvergenceError
from harvester.studies.smaller_step import TRIES, at_smaller_steps

PLATE = Problem(hv.load("examples/plate_bridge.toml"))
WORDS = "ngspice stopped at 1 s of 2 s: it did not converge at node 'com'"


def stiff(limit, tried):
    """A computation that converges below a step."""

    def compute(step, shunt):
        tried.append(step)
        if step > limit:
            raise ConvergenceError(WORDS)
        return f"with {step:g}"

    return compute


def test_the_first_step_that_converges_is_taken_and_told():
    tried = []
    found, step, (note,) = at_smaller_steps(PLATE, 0.08, stiff(0.03, tried))
    assert (found, step, tried) == ("with 0.02", 0.02, [0.08, 0.02])
    assert note.code == "smaller_step_converges" and note.numbers["taken"].endswith("s")
    assert at_smaller_steps(PLATE, 0.02, stiff(0.03, [])) == ("with 0.02", 0.02, ())


def test_an_error_says_which_steps_were_tried():
    tried = []
    with pytest.raises(
        CircuitError, match=r"at node 'com'; steps of .* to .*s and 5.* pF from each node .* tried"
    ):
        at_smaller_steps(PLATE, 0.08, stiff(0.0, tried))
    assert len(tried) == len(TRIES)


def test_a_shunt_is_tried_last_and_told():
    def floating(step, shunt):
        if not shunt:
            raise ConvergenceError(WORDS)
        return shunt

    found, step, (warning,) = at_smaller_steps(PLATE, 0.08, floating)
    assert (found, step, warning.code) == (1e-5, 0.08, "shunt_converges")
    assert "5e-13 F from each node to ground, 1e-05 of the piezo's" in str(warning)


def test_what_no_step_helps_is_raised_at_once():
    tried = []

    def refuse(step, shunt):
        tried.append(step)
        raise CircuitError("ngspice refused the circuit: no such model")

    with pytest.raises(CircuitError, match=r"no such model$"):
        at_smaller_steps(PLATE, 0.08, refuse)
    assert len(tried) == 1
