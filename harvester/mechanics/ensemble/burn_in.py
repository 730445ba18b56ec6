"""Burn-in: trajectories run until their start is forgotten, as the data and the scene's memory show.

Windows of doubled length, with an expensive circuit of a third of all time, follow each other until
the means of E[x^2], E[x'^2] and E[V^2] in two neighbours agree within two standard errors, and
until these times have passed: `LOAD_TIMES` time constants of the load (1/mu; with a circuit,
`CHARGING_TIMES` of its capacitor, kappa/mu, and its power agrees as well) and `CORRELATION_TIMES`
correlation times of the energy, of V^2 and of the load's power, estimated from the same window.
The last one may be shorter.

A circuit with a kernel of its own may charge a storage capacitor while its load is off, which no such mean shows: its
windows continue while the energy in its capacitors changes (`surely_gained`), for `PATIENCE` times as
long and as long as a budget allows.  The averages then show whether it still does.

Between unlike wells these times are those of x as well, which sees inter-well transitions.  If
inter-well transitions are so rare that this would last too long, the burn-in ends when all else is
forgotten (`harvester.mechanics.ensemble.hopping`).
"""

import math
import time

from harvester.arrays import Floats
from harvester.equations.bounds import (
    SLOWEST,
    friction_bounds,
    growth_near,
    strongest_feed,
    surely_bounded,
)
from harvester.equations.coefficients import Equations
from harvester.errors import SimulationError, UnboundedResponseError, invalid
from harvester.linear.record_doubts import density_doubts, record_doubts
from harvester.machine.progress import listener, stage
from harvester.mechanics.ensemble.affordable_steps import FIRST_WINDOW, check_cost, exceeds
from harvester.mechanics.ensemble.hopping import Hopping, hopping
from harvester.mechanics.ensemble.trajectories import LateError, NotFiniteError, Trajectories
from harvester.mechanics.kernels.moments import Moments, correlation_time
from harvester.mechanics.kernels.step_size import (
    STEP,
    chatter,
    remedy,
    shorter_step,
    typical_frequency,
)
from harvester.presentation.diagnostic import Diagnostic, warning
from harvester.records.records import Record
from harvester.uncertainty.value import mean_and_error

SHORTEST = 0.25  # of the window before: one that ends a burn-in
# times the burn-in so far, that a window must have for its correlation times
HALF = 0.5
ROOM = 0.75  # the part of a budget for the burn-in with a kernel of a circuit
LONGEST = 2e5  # time units: the burn-in ends here whatever the data say
# from a window of half the burn-in they come out too short by a quarter at worst
CORRELATION_TIMES = 10.0
DRIFTING = 2.0  # times as long, where means may still change by inter-well transitions
TRANSIENTS = 1.2  # times CORRELATION_TIMES: time constants of a small transient: e^-12 is left
OVER = 1.25  # times the budget, at which a window ends that became slower than expected
# a change of the stored energy that counts as settled, over the load's energy in that time
CHARGED = 0.1
# for storage that still changes: times the burn-in so far, and the part of a budget
PATIENCE = 32.0
CHARGING_ROOM = 0.4
GROWN = 1e12  # times the first energy: a growth that no response without a growing friction shows


def burn_in(
    trajectories: Trajectories, budget: float | None = None, forgotten: float = CORRELATION_TIMES
) -> list[Diagnostic]:
    """Run trajectories until their start is forgotten, and return warnings.

    It is ``forgotten`` after so many correlation times.

    A step that turns out too long for the response is made shorter, and the trajectories begin
    again, unless their step is fixed.  ``budget`` is the time that this may need, about, in
    seconds; below one it counts as one.

    Raises UnboundedResponseError when the energy keeps growing; SimulationError when it is bounded,
    but does not become stationary in the budget, or in a sensible time; InputError for a fixed step
    in which friction feeds too much.
    """
    if (
        trajectories.step_is_fixed
        and trajectories.h * (feed := strongest_feed(trajectories.eqs)) > 1.0
    ):
        raise invalid(
            "`dt`",
            f"be below {1.0 / feed:.3g}/w0, for damping is negative somewhere",
            f"{trajectories.h:.3g}/w0",
        )
    begin = time.perf_counter()
    while True:
        try:
            moments, warnings = until_steady(trajectories, budget, begin, forgotten)
        except NotFiniteError:
            if trajectories.step_is_fixed or trajectories.h < 1e-3 * STEP:
                raise
            trajectories.restart(trajectories.h / 8)
            continue
        eqs = trajectories.eqs
        h = trajectories.h
        x2 = moments.mean("x2")[0]
        v2 = moments.mean("v2")[0]
        frequency = typical_frequency(eqs, x2, v2)
        shorter = None if trajectories.step_is_fixed else shorter_step(h, frequency)
        if shorter is None:
            frequency = max(frequency, chatter(eqs.pressure, eqs.n1, v2))
            if h * frequency > 5 * STEP:
                warnings.append(warning("coarse_step", step=h, frequency=frequency))
            if (shaker := trajectories.shakers[0]) is not None and shaker.samples is not None:
                warnings += record_doubts(eqs) + density_doubts(eqs, Record(h, shaker.samples))
            return warnings
        trajectories.restart(shorter)


def until_steady(
    trajectories: Trajectories,
    budget: float | None = None,
    begin: float | None = None,
    forgotten: float = CORRELATION_TIMES,
) -> tuple[Moments, list[Diagnostic]]:
    """Run at the present step until the start is forgotten: moments of the last window, and warnings.

    ``begin`` is the time (`time.perf_counter`) from which the ``budget`` counts, by default now.

    Raises UnboundedResponseError when the energy keeps growing; SimulationError when it is bounded,
    but still changes after `LONGEST`; or when more steps are needed than ``budget`` allows.  The
    load's memory is counted from the beginning.
    """
    load = trajectories.loaded.memories * trajectories.loaded.memory
    begin = time.perf_counter() if begin is None else begin
    length = FIRST_WINDOW
    before = None
    first = None
    end = max(load, 3.0 * FIRST_WINDOW)  # two windows at least
    storage = _Storage(trajectories, budget, begin)
    while True:
        length = _affordable(trajectories, length, load, budget, begin)
        now = _window(trajectories, length, end, budget, begin)
        means = now.averaged(trajectories.together)
        energy = means.mean("x2")[0] + means.mean("v2")[0]
        first = energy if first is None else first
        _check_growth(trajectories, energy, first)
        steady = _agree(means, before, "x2", "v2")
        response = forgotten * memory(trajectories, now, length)
        same = steady and _agree(means, before, "V2", "load")
        settled = same and trajectories.time >= max(load, response)
        if storage.lets_end(now, length, settled):
            return now, []
        if before is not None and (hops := _rare_hops(trajectories, now, length, same, load)):
            of_hops = CORRELATION_TIMES / hops.rate
            if of_hops > LONGEST or exceeds(trajectories, of_hops, budget, begin)[0]:
                trajectories.hopping = hops
                return now, []
        if energy <= first / GROWN:
            return now, [warning("dies_out")]
        if trajectories.time >= LONGEST:
            if not steady:
                raise _not_stationary(trajectories)
            return now, [_cut_short(trajectories, load, response)]
        end = max(load, response)
        length = _next_window(trajectories, length, same and not settled, end)
        before = means


class _Storage:
    """The stored energy of trajectories from window to window."""

    def __init__(self, trajectories: Trajectories, budget: float | None, begin: float) -> None:
        self._trajectories = trajectories
        self._room = None if budget is None else CHARGING_ROOM * budget
        self._begin = begin
        self._stored = trajectories.stored
        self._end = math.inf

    def lets_end(self, window: Moments, length: float, settled: bool) -> bool:
        """Whether all else has ``settled``, and storage as well, or no time for another window is left.

        Storage has if it changed little in a ``window`` of a ``length``.
        """
        before = self._stored
        self._stored = self._trajectories.stored
        now = self._trajectories.time
        if not settled:
            return False
        self._end = min(self._end, PATIENCE * now)
        gained = surely_gained(self._stored - before)
        if gained <= CHARGED * length * float(window.load.mean()) or now >= self._end:
            return True
        return exceeds(self._trajectories, SHORTEST * now, self._room, self._begin)[0]


def surely_gained(energies: Floats) -> float:
    """The size of the mean of energies that trajectories gained, beyond two standard errors."""
    mean, error = mean_and_error(energies)
    return max(abs(mean) - 2.0 * error, 0.0)


def _window(
    trajectories: Trajectories, length: float, end: float, budget: float | None, begin: float
) -> Moments:
    """Run a window of a burn-in to about ``end``, no longer than `OVER` times the budget."""
    deadline = math.inf if budget is None else begin + OVER * max(budget, 1.0)
    try:
        whole = max(trajectories.time + length, min(end, LONGEST))
        with stage(trajectories.time / whole, (trajectories.time + length) / whole):
            return trajectories.run(length, listener(), deadline)
    except LateError:
        check_cost(trajectories, length, budget, begin)
        raise


def _next_window(trajectories: Trajectories, length: float, same: bool, end: float) -> float:
    """Twice the length of the last; with a compiled circuit `HALF` of the time so far.

    Once its windows agree, that circuit has none beyond the ``end``.
    """
    if not trajectories.loaded.is_dear:
        return 2.0 * length
    if not same:
        return max(HALF * trajectories.time, FIRST_WINDOW)
    return min(2.0 * length, max(end - trajectories.time, SHORTEST * length))


def _affordable(
    trajectories: Trajectories, length: float, load: float, budget: float | None, begin: float
) -> float:
    """The next window of a ``length``, of an expensive circuit cut to the budget.

    Raises SimulationError if neither that nor the memory of its ``load`` fits into it.
    """
    if budget is None:
        check_cost(trajectories, length, budget, begin)
        return length
    if (so_far := trajectories.time) > 0.0 and trajectories.loaded.is_dear:
        spent = time.perf_counter() - begin
        length = cut_window(length, so_far, ROOM * budget / spent - 1.0)
    check_cost(trajectories, max(length, min(load, LONGEST) - so_far), budget, begin)
    return length


def cut_window(length: float, burnt_in: float, share: float) -> float:
    """The next window: a ``length``, or the ``share`` of ``burnt_in`` that a budget leaves.

    At least `SHORTEST` of that time: means of less would agree whatever they are.
    """
    return min(length, max(share, SHORTEST) * burnt_in)


def _agree(means: Moments, before: Moments | None, *names: str) -> bool:
    """Whether the means of two windows agree in these moments; False of a first window."""
    return before is not None and all(means.agrees(before, name) for name in names)


def _check_growth(trajectories: Trajectories, energy: float, first: float) -> None:
    """Refuse an energy that grew `GROWN` times, unless a growing friction bounds it."""
    if energy > GROWN * max(first, 1e-300) and not friction_bounds(trajectories.eqs):
        raise UnboundedResponseError(
            f"the response grows without bound: its energy grew {energy / first:.1e} times in "
            f"{trajectories.time:g}/w0; {remedy(trajectories.eqs, trajectories.h)}"
        )


def _rare_hops(
    trajectories: Trajectories, now: Moments, length: float, same: bool, load: float
) -> Hopping | None:
    """The transitions between unlike wells, if they are few and all else is forgotten.

    None elsewhere.
    """
    eqs = trajectories.eqs
    if not (eqs.has_unlike_wells and eqs.is_shaken and eqs.is_random):
        return None
    hops = hopping(eqs, trajectories.start[0], trajectories.snapshot()[0], trajectories.time)
    rare = 2 * hops.hops < hops.count and _all_but_hops(trajectories, now, length, same, load, hops)
    return hops if rare else None


def _all_but_hops(
    trajectories: Trajectories, now: Moments, length: float, same: bool, load: float, hops: Hopping
) -> bool:
    """Whether all but inter-well transitions is forgotten.

    ``same``: the means are no longer seen to change.
    """
    within = CORRELATION_TIMES * memory(trajectories, now, length, hops)
    return trajectories.time >= max(load, within if same else DRIFTING * within)


def memory(
    trajectories: Trajectories, window: Moments, length: float, hops: Hopping | None = None
) -> float:
    """Longest correlation time of energy, V^2 and load power, from a window of a ``length`` that ends now.

    Without noise that of a small transient (`slowest_transient`), so that `CORRELATION_TIMES` of it
    leave `TRANSIENTS` times as many.  Between unlike wells also that of x, which sees transitions
    however rare: trajectories begin in each of the wells.  With ``hops``, the effect of inter-well
    transitions is left out.
    """
    eqs = trajectories.eqs
    if not eqs.is_random:
        return TRANSIENTS * slowest_transient(eqs)
    x, v, voltage = trajectories.snapshot()
    pairs = [(window.x2 + window.v2, x * x + v * v), (window.V2, voltage * voltage)]
    if eqs.has_unlike_wells:
        pairs.append((window.x, x))
    pairs += trajectories.loaded.powers(window, trajectories.state)
    if hops is not None:
        pairs = [
            (hops.less_well_means(means), hops.less_well_means(values)) for means, values in pairs
        ]
    return max(correlation_time(means, values, length) for means, values in pairs)


def slowest_transient(eqs: Equations) -> float:
    """Longest time constant of small motions about the places of rest; 0 if some do not die out."""
    rate = -max(growth_near(eqs, x) for x in eqs.resting_places or [0.0])
    return 1.0 / rate if rate > SLOWEST else 0.0


def _cut_short(trajectories: Trajectories, load: float, response: float) -> Diagnostic:
    """Why a burn-in of `LONGEST` may be too short."""
    why, constant = "", ""
    if load > trajectories.time:
        pair = trajectories.loaded
        constant = f"{pair.constant} = {pair.memory:g}"
        why = "load"
    elif response > trajectories.time:
        why = "response"
        constant = f"{response / CORRELATION_TIMES:.2g}"
    return warning("burn_in_stopped", time=trajectories.time, why=why, constant=constant)


def _not_stationary(trajectories: Trajectories) -> SimulationError:
    """The error of a response that still changes after `LONGEST`."""
    after = f"its energy still changes after {trajectories.time:g}/w0"
    if surely_bounded(trajectories.eqs):
        return SimulationError(
            f"no stationary response was seen: {after}; add damping, so that it settles sooner"
        )
    return UnboundedResponseError(
        f"the response grows without bound: {after}; add damping or a stop with restitution below 1"
    )
