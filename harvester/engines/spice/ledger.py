"""The energy balances of ngspice runs: entries of an answer, and doubts about a netlist."""

from typing import TYPE_CHECKING

import numpy as np

from harvester.answers.open_balance import open_balance
from harvester.errors import SimulationError
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.uncertainty.value import Value, mean_and_error

if TYPE_CHECKING:
    from harvester.cosimulation.lockstep.energy_ledger import EnergyLedger

# shares of the load's power that are told, beyond so many standard errors
GIVEN = 0.02
STORED = 0.1
SURE = 4.0


def ledger_entries(
    ledgers: "list[EnergyLedger]", watts: float, load_bias: float = 0.0
) -> dict[str, float]:
    """The energy balance, the mean of these, in units of ``watts``, with errors.

    See `energy_ledger`.

    For several runs each entry has its standard error (by Student's t if they are few).  That of
    the load, which is the mean power, has the error ``load_bias`` (in these units) with it.
    """
    from harvester.cosimulation.lockstep.energy_ledger import mean_ledger

    whole = mean_ledger(ledgers)
    entries = {f"ledger_{name}": value / watts for name, value in vars(whole).items()}
    for name in vars(whole) if len(ledgers) > 1 else ():
        mean, stderr = mean_and_error(
            np.array([getattr(ledger, name) for ledger in ledgers]) / watts
        )
        if stderr > 0.0:
            entries[f"ledger_{name}_stderr"] = Value(
                mean, stderr, dof=len(ledgers) - 1.0
            ).normal_stderr
    known = {"ledger_load_bias": load_bias} if load_bias else {}
    return entries | known | {"ledger_residual": whole.residual}


def gives_power(watts: float) -> SimulationError:
    """The error for a load that gives so much power in place of drawing it."""
    return SimulationError(
        f"Rload of the netlist must be above 0 and draw power, but gives {watts:.3g} W"
    )


def ledger_remarks(ledgers: "list[EnergyLedger]") -> list[Diagnostic]:
    """Warnings of energy balances that do not close, and of a netlist that gives energy, or continues to store it.

    Each beyond the errors of several runs.
    """
    residual, error = mean_and_error(np.array([ledger.residual for ledger in ledgers]))
    sums_up = open_balance(Value(residual, error, dof=len(ledgers) - 1.0))
    remarks = [] if sums_up is None else [sums_up]
    load = abs(float(np.mean([ledger.load for ledger in ledgers])))
    given, error = mean_and_error(-np.array([ledger.circuit for ledger in ledgers]))
    if given - SURE * error > GIVEN * load:
        remarks.append(warning("netlist_gives", share=given / load))
    stored, error = mean_and_error(np.array([ledger.stored for ledger in ledgers]))
    if stored - SURE * error > STORED * load:
        remarks.append(warning("netlist_stores", share=stored / load))
    return remarks
