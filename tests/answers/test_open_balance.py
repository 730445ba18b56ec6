"""A power balance or energy balance that its errors do not explain is a warning: the rule, and
where a real one is open."""

import numpy as np
import pytest

import harvester as hv
from harvester.answers.open_balance import open_balance
from harvester.cosimulation.lockstep.energy_ledger import EnergyLedger
from harvester.engines.sampling import power_balance
from harvester.engines.spice.ledger import ledger_remarks
from harvester.equations.coefficients import Equations
from harvester.mechanics.ensemble.trajectories import Trajectories
from tests.support.models import Motion, Oscillator


@pytest.mark.parametrize(
    ("balance", "told"),
    [
        (hv.Value(0.019), False),
        (hv.Value(-0.021), True),
        (hv.Value(0.2, 0.05), False),  # 3.9 standard errors and what is borne
        (hv.Value(0.22, 0.05), True),
        (hv.Value(0.25, 0.05, dof=7.0), False),  # of eight runs, whose spread is not known well
        (hv.Value(-0.258, 0.005, 1.255), False),  # the step is far too large, and states so itself
        (hv.Value(-23.8, 0.01, 0.002), True),  # a ball at rest that rounding made bounce
    ],
)
def test_what_errors_explain(balance, told):
    found = open_balance(balance)
    assert (found is not None) == told
    assert found is None or f"{100.0 * balance.value:.2f} % of the power is unaccounted for" in str(
        found
    )


def test_trajectories_that_still_take_up_energy():
    """From rest the noise fills the oscillator; once that has its fraction of energy, the balance closes."""
    eqs = Equations(beta=0.05, mu=1.0, c1=-0.02, n1=0.01)
    many = Trajectories(eqs, 512, np.random.SeedSequence(1), 0.1)
    balances = []
    for seconds in (20.0, 300.0, 20.0):
        balance, stderr = power_balance(many.run(seconds), eqs)
        balances.append(hv.Value(balance, stderr, dof=511.0))
    assert balances[0].value > 0.5
    assert [open_balance(one) is not None for one in (balances[0], balances[2])] == [True, False]


def test_ledgers_of_several_runs():
    """Their mean counts, by the spread between them."""
    whole = [EnergyLedger(input=1.0, damping=0.5, load=0.5 + d) for d in (-0.02, 0.02, 0.01, -0.01)]
    lost = [EnergyLedger(input=1.0, damping=0.5, load=0.4 + d) for d in (-0.02, 0.02, 0.01, -0.01)]
    assert [one.code for one in ledger_remarks(whole)] == []
    assert [one.code for one in ledger_remarks(lost)] == ["open_balance"]


@pytest.mark.ngspice
def test_a_model_at_a_coarse_step():
    """Six steps to a period leave the energy balance open, and the answer states so; sixty do
    not."""
    piezo = hv.Piezo(coupling="1 mN/V", capacitance="50.2 nF")
    plate = Oscillator(m=0.04, k=16.0, c=0.0)
    start = Motion(1e-3, 0.05)
    load = hv.Load(resistance=1e6)
    rough, fine = (
        hv.cosimulate(plate, load, piezo, start, "2 s", h, compiled=False)
        for h in ("50 ms", "5 ms")
    )
    assert [one.code for one in rough.diagnostics] == ["open_balance", "model_path"]
    assert abs(fine.ledger_residual) < 0.02 < abs(rough.ledger_residual)
    assert [one.code for one in fine.diagnostics] == ["model_path"]
