"""A circuit that charges storage before its load is on: averages begin after that, or the answer states it."""

from types import SimpleNamespace

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.compiled_circuit import compiled_circuit
from harvester.equations.problem import Problem
from harvester.mechanics.ensemble import burn_in
from harvester.mechanics.ensemble.richardson import Look
from harvester.mechanics.kernels.trajectory_batch import MASS_ROWS
from tests.support.paths import EXAMPLES


def chip():
    """A chip that starts cold on a strong vibration."""
    scene = hv.load(EXAMPLES / "bimorph_bq25570.toml")
    scene = scene.vary("oscillator.damping_ratio", 0.3)
    scene = scene.vary("excitation.acceleration_amplitude", "1.2 g")
    scene = scene.vary("load.parameters.Cout", 0.5e-6)
    return scene.vary("load.parameters.C", 1e-6)


def codes(answer):
    """The codes of the answer's diagnostics."""
    return {said.code for said in answer.diagnostics}


def test_averages_begin_after_a_cold_start():
    """The load is off in the first windows, which agree; 156.5 uW are those of 'slow'."""
    answer = hv.Compiled(dt=4e-4, duration=0.3, judged=False).run(chip())
    assert answer.mean_power.value == pytest.approx(156.5e-6, rel=0.03)
    assert {"clock_not_covered"} == codes(answer) & {"clock_not_covered", "storage_not_settled"}
    assert "the circuit's own slow clock" in answer.mean_power.unknown


@pytest.mark.parametrize(("seconds", "uncovered"), [(10.0, True), (62.0, True), (64.0, False)])
def test_averages_cover_four_periods_of_a_clock(seconds, uncovered):
    """The chip looks at its input every 16 s: the voltage of its clock grows by 1 V/s."""
    problem = Problem.of(chip())
    circuit = compiled_circuit(problem.load_circuit, problem.scales)
    unit = problem.scales.frequency
    place = (
        MASS_ROWS
        + circuit.sizes[0]
        + list(circuit.reduction.columns).index(circuit.system.unknowns["xload.xchip.phase"])
    )
    looks = [Look(t * unit, np.append(np.zeros(MASS_ROWS), circuit.rest)) for t in (3.0, 4.0, 6.0)]
    for look in looks:
        look.state[place] = look.time / unit
    pair = SimpleNamespace(
        looks=looks,
        charging=0.0,
        mean=lambda name: (1.0, 0.0),
        duration=seconds * unit,
        trajectories=SimpleNamespace(circuit=circuit),
    )
    unknown, said = hv.Compiled().not_covered(problem, pair)
    assert bool(unknown) == uncovered == (said is not None)
    assert said is None or said.numbers["period"] == pytest.approx(16.0)


def test_a_cold_start_beyond_the_patience_is_no_stationary_power(monkeypatch):
    monkeypatch.setattr(burn_in, "PATIENCE", 1.0)
    answer = hv.Compiled(dt=4e-4, duration=0.3, judged=False).run(chip())
    assert "storage_not_settled" in codes(answer)
    assert not answer.has_settled
    assert "storage that is not settled" in answer.mean_power.unknown
    assert "storage that is not settled" in answer.mean_square_voltage.unknown
