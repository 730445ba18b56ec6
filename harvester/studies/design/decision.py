"""The study of designs: from a requirement to the circuit, the parts and the capacitor that meet it.

The rectifier's mean current of each circuit is measured at a held storage capacitor
(`harvester.storage`). It gives at once the power at the voltage needed, and the charging time to
it.
"""

import math
import time
from collections.abc import Mapping, Sequence

from harvester.engines.protocol import AnyScene
from harvester.equations.power_bound import power_bound
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, SimulationError, names_arguments, unknown
from harvester.machine import files
from harvester.machine.execution import DEFAULT, Execution, working_on
from harvester.machine.progress import PartOfProgress, Progress, listening
from harvester.machine.threads import in_threads
from harvester.presentation.diagnostic import Diagnostic, note, refusal, warning
from harvester.scene.plausibility import unusual_values
from harvester.scene.scene import Scene
from harvester.scene.scene_writer import as_written
from harvester.storage.bought_parts import CHIPS
from harvester.storage.time_limit import TimeLimit, limited
from harvester.studies.design.candidate import (
    Candidate,
    Given,
    capacitance,
    capacitor,
    nominal,
    of_capacitor,
)
from harvester.studies.design.design_need import DesignNeed, read_need
from harvester.studies.design.design_result import DesignCandidate, DesignResult
from harvester.studies.design.yield_share import NOMINAL, Outcomes, shares_met
from harvester.studies.output_folder import OutputFolder, provenance
from harvester.studies.tolerance.distribution import ShareInterval
from harvester.studies.tolerance.spreads import spreads as read_spreads
from harvester.uncertainty.value import amount

CIRCUITS = ("bridge", "doubler", "series_sshi", "parallel_sshi")


@names_arguments
def design(
    scene: AnyScene,
    *,
    needs: str | None = None,
    wake: float | str | None = None,
    spread: Mapping[str, str] | Sequence[str] | str = (),
    limit: Sequence[str] | str = (),
    circuits: Sequence[str] | None = None,
    chips: Sequence[str] | None = None,
    budget: float | str | None = None,
    seed: int = 0,
    execution: Execution = DEFAULT,
) -> DesignResult:
    """Choose a circuit and a storage capacitor that deliver a required power at a required voltage.

    Without ``spread``, the first circuit in ``circuits`` that meets all requirements is chosen;
    with ``spread``, the one with the highest yield.

    Parameters
    ----------
    scene : Scene or path
        A `Scene`, or the path of its file; its load is ignored.
    needs : str, optional
        Power at a voltage, such as "40 uW at 3.3 V". Default: the consumption of the scene's
        [node], at its wake voltage, or behind a chip at its supply voltage.
    wake : float or str, optional
        Longest charging time from empty to that voltage (s, or a text such as "10 s").
    spread : mapping or list of str or str, optional
        Manufacturing spreads of keys, as ``vary`` of `tolerance`, such as "frequency=2Hz".
    limit : list of str or str, optional
        Limits such as "peak_displacement < 1 mm" (harmonic excitation) and "mean_power > 50 uW".
    circuits, chips : list of str, optional
        Names of netlists, the simplest first, and of chips. Default: bridge, doubler, series_sshi,
        parallel_sshi and, under a harmonic excitation, every chip that has a netlist.
    budget : float or str, optional
        Time limit (s, or such as "60s"), without compilation: circuits whose power or yield is not
        known by then are left out, with a note. Default: unlimited.
    seed : int, default 0
        Random seed.
    execution : Execution, optional
        Folder for design.csv, design.toml and provenance.json, number of workers, and progress.

    Returns
    -------
    DesignResult
        The chosen circuit, and all candidates.

    Raises
    ------
    InputError
        A text has another form, the scene has no device in SI units, a displacement is limited
        under noise, or no circuit meets all requirements (with the nearest).
    SimulationError
        The ``budget`` ends before any circuit's power, or with ``spread`` any yield, is known.

    Examples
    --------
    >>> import harvester as hv
    >>> hv.design("examples/bimorph_sensor.toml", needs="40 uW at 3.3 V", circuits=["bridge"]).circuit
    'bridge'
    """
    problem = Problem.of(scene)
    device = problem.scene
    if not device.physical:
        raise InputError("scene must be a device in SI units for a design, but is nondimensional")
    needed = read_need(device, needs, wake, limit)
    spreads = read_spreads(spread, device, "spread") if spread else ()
    folder = OutputFolder.of(execution)
    begin = time.perf_counter()
    clock = TimeLimit.of(budget)
    names = _names(circuits, chips, problem)
    farads = capacitor(capacitance(needed, device), device)
    with working_on("design", execution), limited(clock):
        part = PartOfProgress(execution.progress, 0.0, NOMINAL if spreads else 1.0)
        candidates, left_out = _nominal(
            device, names, needed=needed, farads=farads, seed=seed, progress=part
        )
        if circuits is None and chips is None:
            left_out += _chips_not_compared(names)
        meeting = {
            name: candidate
            for name, candidate in candidates.items()
            if not candidate[1].unmet(_need(needed, name))
        }
        if not meeting:
            raise InputError(_nearest(candidates, needed, problem, left_out))
        shares, too_late = (
            shares_met(
                device,
                meeting,
                needed=needed,
                farads=farads,
                spreads=spreads,
                seed=seed,
                execution=execution,
            )
            if spreads
            else ({}, [])
        )
        if clock is not None and too_late:
            names_late = ", ".join(too_late)
            left_out.append(warning("shares_left_out", names=names_late, budget=clock.budget))
    order = _order(meeting, shares)
    chosen, best = candidates[order[0]]
    smallest = capacitance(needed, device, best.kept)
    farads = capacitor(smallest, device)
    there = _need(needed, chosen.circuit)
    check = note("design_check", needed=there.load, whole=there.voltage**2 / best.power.value)
    remarks = [
        *unusual_values(device),
        *left_out,
        note("design_by_share" if spreads else "design_simplest"),
        check,
        *of_capacitor(device, smallest),
    ]
    if chosen.coil is not None:
        remarks.append(warning("detector_not_counted", chosen.circuit))
    result = _result(
        problem,
        needed,
        farads=farads,
        candidates=candidates,
        order=order,
        shares=shares,
        diagnostics=remarks,
        begin=begin,
    )
    if folder is not None:
        folder.table("design", result.table.csv())
        files.write(folder.path / "design.toml", as_written(result.scene))
        folder.figure("design", result.plot())
        folder.provenance(
            provenance(problem, needs=needed.needs, wake=needed.wake_written, circuits=list(names))
        )
    return result


def _names(
    circuits: Sequence[str] | None, chips: Sequence[str] | None, problem: Problem
) -> tuple[str, ...]:
    """The names of circuits and chips to choose from; InputError for a chip that there is not."""
    # the others are tables for a node
    of_netlists = [name for name, chip in CHIPS.items() if chip.netlist == name]
    if circuits is None and chips is None:
        return CIRCUITS if problem.equations.drive is None else (*CIRCUITS, *of_netlists)
    for chip_name in chips or ():
        if chip_name not in of_netlists:
            raise unknown("chip of `chips`", chip_name, of_netlists)
    if not (circuits or chips):
        raise InputError("`circuits` or `chips` must name one to choose from, but there is none")
    return tuple(dict.fromkeys((*(circuits or ()), *(chips or ()))))


def _need(needed: DesignNeed, name: str) -> DesignNeed:
    """The need that the circuit or chip of this name must meet."""
    return needed.for_circuit(is_chip=name in CHIPS)


def _chips_not_compared(names: Sequence[str]) -> list[Diagnostic]:
    """Why the chips that are not among the ``names`` are left out."""
    reasons = {
        name: refusal("chip_not_asked" if chip.netlist == name else "chip_without_netlist")
        for name, chip in CHIPS.items()
        if name not in names
    }
    return [note("circuit_left_out", name, why=str(why)) for name, why in reasons.items()]


def _nominal(
    device: Scene,
    names: Sequence[str],
    needed: DesignNeed,
    farads: float,
    seed: int,
    progress: Progress,
) -> tuple[dict[str, tuple[Candidate, Given]], list[Diagnostic]]:
    """The answer of each circuit for the scene itself, and those left out.

    InputError if none gives anything.
    """
    candidates = dict[str, tuple[Candidate, Given]]()
    left_out = list[Diagnostic]()

    shares = dict.fromkeys(names, 0.0)  # done by each circuit

    def given(name: str) -> tuple[Candidate, Given] | Diagnostic:
        def report(share: float) -> None:
            shares[name] = max(shares[name], share)
            progress.step(sum(shares.values()) / len(names), name)

        try:
            with listening(report):
                return nominal(device, name, _need(needed, name), farads, seed)
        except (CannotServeError, SimulationError) as error:
            return note("circuit_left_out", name, why=str(error))
        finally:
            report(1.0)

    with in_threads(given, names) as outcomes:
        for name, outcome in zip(names, outcomes, strict=True):
            if isinstance(outcome, Diagnostic):
                left_out.append(outcome)
            else:
                candidates[name] = outcome
    if not candidates:
        why = "; ".join(f"{reason.about}: {reason.numbers['why']}" for reason in left_out)
        raise InputError(f"`circuits` must have one that can be measured, but none can ({why})")
    return candidates, left_out


def _order(meeting: Outcomes, shares: Mapping[str, ShareInterval]) -> list[str]:
    """The circuits that meet everything, the one to choose first, then the runner-up."""
    if not shares:
        first, *others = meeting
        return [first, *sorted(others, key=lambda name: -meeting[name][1].power.value)]
    best = max(shares.values(), key=lambda share: share.value)
    alike = [name for name, share in shares.items() if share.value >= (best.low or 0.0)]
    others = [name for name in meeting if name != alike[0]]
    return [
        alike[0],
        *sorted(others, key=lambda name: -shares[name].value if name in shares else 1.0),
    ]


def _result(
    problem: Problem,
    needed: DesignNeed,
    farads: float,
    candidates: Outcomes,
    order: Sequence[str],
    shares: Mapping[str, ShareInterval],
    diagnostics: Sequence[Diagnostic],
    begin: float,
) -> DesignResult:
    """The decision, of a study that continued since the time ``begin`` of `time.perf_counter`."""
    chosen, best = candidates[order[0]]
    there = _need(needed, chosen.circuit)
    requirements = [
        needed.needs,
        *([f"awake in {needed.wake_written}"] if needed.wake is not None else []),
    ]
    return DesignResult(
        circuit=chosen.circuit,
        coil=chosen.coil,
        settings=chosen.parameters,
        power_needed=there.power,
        load_resistance=there.load,
        capacitor=farads,
        available=best.power,
        wake=best.wake,
        largest_displacement=best.displacement,
        met=shares.get(chosen.circuit),
        verdict=dict.fromkeys([*requirements, *(limit.written for limit in needed.limits)], True),
        runner_up=order[1] if len(order) > 1 else None,
        bound=power_bound(problem),
        candidates=tuple(
            DesignCandidate(
                circuit=name,
                coil=candidates[name][0].coil,
                available=candidates[name][1].power,
                share_met=shares[name].value if name in shares else None,
                wake=candidates[name][1].wake if math.isfinite(candidates[name][1].wake) else None,
                meets=name in order,
            )
            for name in (*order, *(other for other in candidates if other not in order))
        ),
        scene=chosen.scene(problem.scene, there, farads),
        seconds=time.perf_counter() - begin,
        steps=sum(given.steps for _, given in candidates.values()),
        diagnostics=tuple(diagnostics),
    )


def _nearest(
    candidates: Outcomes, needed: DesignNeed, problem: Problem, left_out: Sequence[Diagnostic]
) -> str:
    """The one line that states that no circuit meets everything, and which comes nearest."""
    by_unmet = {
        name: (len(given.unmet(_need(needed, name))), -given.power.value)
        for name, (_, given) in candidates.items()
    }
    name = min(by_unmet, key=lambda circuit: by_unmet[circuit])
    candidate, best = candidates[name]
    with_coil = "" if candidate.coil is None else f" with {candidate.coil}"
    bound = power_bound(problem)
    most = (
        ""
        if bound is None
        else f"; no device of this mass absorbs more than {amount(bound.value, 'W')}"
    )
    reasons = "; ".join(f"{reason.about}: {reason.numbers['why']}" for reason in left_out)
    out = f" (left out: {reasons})" if left_out else ""
    return (
        f"`needs`, `wake` and `limit` must be met by a circuit, but none of {', '.join(candidates)}{out} does: nearest "
        f"is {name}{with_coil}, asked for {'; '.join(best.unmet(_need(needed, name)))}{most}"
    )
