"""What engine `spice` answers from runs on noise: means, the power balance or the ledger, and what is known of each."""

import dataclasses

from harvester.answers.estimate import Estimate
from harvester.engines.moment_existence import MomentExistence
from harvester.engines.protocol import estimate
from harvester.engines.sampling import agreement, power_balance
from harvester.engines.spice.ledger import ledger_entries
from harvester.engines.spice.probes import Watch, with_sampled_probes
from harvester.engines.spice.runs import Runs
from harvester.engines.spice.setup import stand_in
from harvester.equations.problem import Problem
from harvester.presentation.diagnostic import Diagnostic


def sampled_estimate(
    name: str, problem: Problem, runs: Runs, exists: MomentExistence, watch: Watch, said: list[Diagnostic | None]
) -> Estimate:
    """The answer that runs give; ``said`` is what their sampling has to say."""
    setup, eqs, unit = runs.setup, problem.equations, problem.units.frequency
    step, burn_in = setup.device.h / unit, setup.settling / unit
    details = {"step": step, "burn_in": burn_in, "duration": runs.n_steps * step - burn_in}
    details |= {"trajectories": len(runs.done)} | runs.details() | {"warm_up_seconds": runs.warm_up_seconds}
    doubts, moments = runs.doubts(), runs.moments()
    if setup.resistive and eqs.stop_stiffness is None:  # the balance holds for a load resistor and rigid stops only
        details["power_balance"], details["power_balance_stderr"] = power_balance(moments, eqs)
    else:
        details |= ledger_entries([one.ledger for one in runs.done], problem.scales.watts / problem.units.watts)
    agreed = agreement(moments) if eqs.is_steady else None
    exact = agreed is not None and agreed.severity == "note"
    v2, power = (
        dataclasses.replace(one.value, stderr=None)
        if exact
        else one.value.with_unknown(exists.unknown).with_unknown(setup.unknown)
        for one in (runs.mean_square_voltage(), runs.power())
    )
    known = setup.biases(runs.tolerance is not None, runs.followed)
    diagnostics = [*setup.diagnostics, *said, exists.warning, *doubts, known, agreed, stand_in(problem)]
    seconds, steps = setup.seconds + runs.seconds, sum(one.steps for one in (*runs.done, *runs.coarse))
    answer = estimate(name, problem, v2, power, diagnostics, seconds, steps, details, moments.V2)
    answer = with_sampled_probes(answer, problem, watch, runs) if watch.all else answer
    return dataclasses.replace(answer, effects=(*problem.effects, *["netlist"] * (not setup.resistive)))
