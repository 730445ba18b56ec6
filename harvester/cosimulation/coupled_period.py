"""The periodic response of mass and load circuit to a steady excitation: one run of ngspice, period by period.

A period is one short run of ngspice that begins with the node voltages, the inductors' currents and
the motion of a `CoupledState`, the end of the last one; `harvester.mechanics.periodic` finds
the one that comes back. For a circuit that remembers more the response does not come back in
the unbroken run that measures it, and is not used.  Initial conditions of its elements are those of
a run from rest, and no period begins with them.

Long because the state that a period hands to the next one, and its measured means, are of one
trajectory.
"""

import dataclasses
import math

import numpy as np

from harvester.arrays import Floats
from harvester.cosimulation.load_elements import (
    COIL,
    feeds_nothing,
    stores,
    without_initial_conditions,
)
from harvester.cosimulation.lockstep.drive import Drive
from harvester.cosimulation.lockstep.energy_ledger import ledger_of
from harvester.cosimulation.periodic_responses import Known, Neighbour, PeriodicResponse, later_half
from harvester.cosimulation.poincare_sections import (
    CoupledState,
    Origin,
    flat,
    quiet_kick,
    section_of,
    unkicked,
)
from harvester.cosimulation.probe_series import means_of_probes
from harvester.cosimulation.runs import CoupledDevice, run_in_this_process
from harvester.equations.bounds import linear_growth
from harvester.errors import CircuitError
from harvester.mechanics.period_map import PeriodMap
from harvester.mechanics.periodic import (
    ALIKE,
    COMES_BACK,
    FIRST,
    NOISY,
    REACHED,
    STALE,
    WORTH,
    Secants,
    Settling,
    comes_back_after,
)
from harvester.mechanics.trace import mechanics_of
from harvester.netlists.part import PIEZO

# of the state's size: so near a response, the way there is taken to be a straight one
ROUGHLY = 0.03
QUIET = 1.0 / 16.0  # of a period between a section and a turn of the motion, else it moves
# parts of the motion by which it is pushed aside, the second if the first makes it leave a response
# that is known to repeat after several periods, and oscillations in which it must come back
AWAY = 0.02, 0.005
TRIED = 32


class NgspiceMap(PeriodMap):
    """The map of one device in ngspice, from ``section`` to section at one ``phase``.

    The remainder of the way to a response must be below ``enough`` of its size.
    """

    repeats = 1  # after a period that is not averaged

    def __init__(
        self,
        device: CoupledDevice,
        start: Origin | Neighbour,
        farads: float,
        deadline: float,
        enough: float,
    ) -> None:
        super().__init__(device.eqs, device.scales, device.h, farads)
        self.device = dataclasses.replace(device, load=without_initial_conditions(device.load))
        self.section = start.section
        self.phase = round(start.phase * self.size) / self.size
        self.start_turns = start.turns
        if not start.section.nodes:
            self.section = self._on_the_grid(start.section, start.phase)
        self.deadline = deadline
        self.enough = enough
        self.steps = 0
        self.mass_steps = 0
        self.known: list[Known] = []  # of the runs that ended

    def _on_the_grid(self, section: CoupledState, phase: float) -> CoupledState:
        """A section without nodes at the nearest step to its phase, to first order in the time between.

        A circuit's current is left out.
        """
        mechanics = mechanics_of(self.eqs)
        time = (self.phase - phase) * self.size * self.h
        volts = self.scales.volts
        before = mechanics.started(section.start(volts))
        a = float(
            np.interp(phase * self.size, np.arange(self.size + 1), self.shaking(0, self.size))
        )
        after = mechanics.kicked(before, time, a)
        n = len(before) // 2
        speeds = 0.5 * (before[n : 2 * n] + after[n : 2 * n])
        after[:n] += time * speeds
        coupling = np.ones(1) if self.eqs.modes is None else np.array(self.eqs.modes.coupling)
        voltage = before[-1] + time * float(coupling @ speeds - (self.eqs.mu or 0.0) * before[-1])
        across = (voltage * volts, section.across[1])
        return CoupledState.of_motion(after[:-1], across=across)

    def run(
        self,
        section: CoupledState,
        n_steps: int,
        since: int = 0,
        stride: int | None = None,
        earlier: int = 0,
    ) -> tuple[CoupledState, Drive]:
        """Go on for so many kicks, with means from the kick ``since`` on: the section there, and the finished drive.

        It keeps the nodes of so many kicks ``earlier`` as well.
        """
        device = self.device
        s = self.scales
        shaking = self.shaking(round(self.phase * self.size), n_steps)
        drive = Drive(
            device.eqs,
            s.volts,
            s.frequency,
            noise=np.zeros(n_steps),
            h=device.h,
            stride=stride or n_steps,
            start=section.start(s.volts),
            free=not device.load.linear,
            since=(since - 0.5) * device.h,
            shaking=shaking,
            smooth=device.eqs.stop_stiffness is None,
        )
        drive.earlier = earlier
        try:
            run_in_this_process(device, drive, self.deadline, section.nodes)
        except CircuitError as error:
            error.so_far = later_half([*self.known, *([error.so_far] if error.so_far else [])])
            raise
        self.steps += int(drive.state[0].accepted)
        self.mass_steps += n_steps
        self.farads = drive.smoothing
        (power, square, _) = self.means(drive)
        state = drive.state[0]
        self.known.append((float(power), float(square), float(state.end - state.begin)))
        middle = unkicked(device.eqs, drive.last, self.h, float(shaking[-1]))
        return CoupledState.of_motion(middle[:-1], drive.nodes), drive

    def means(self, drive: Drive) -> Floats:
        """Power of Rload (W) and mean square voltage (V^2) in a run, and the mean of x^2 + x'^2 in its last period."""
        s = drive.state[0]
        moved = (drive.kicked[-self.size :, :2] ** 2).sum(axis=1).mean()
        return np.append(
            np.array([s.load, s.square], dtype=np.float64) / float(s.end - s.begin), moved
        )

    @property
    def names(self) -> list[str]:
        """The names of the nodes and inductors of a state."""
        return list(self.section.nodes)

    @property
    def y(self) -> Floats:
        """Coordinates, speeds and the node voltages, in units of the voltage scale."""
        return flat(self.section, self.scales.volts)

    @property
    def coordinates_and_speeds(self) -> int:
        """Those of all modes."""
        return 2 + len(self.section.higher_modes)

    def turn(self, y: Floats, turns: int) -> tuple[Floats, Floats]:
        """As of `PeriodMap`, by a run of its own."""
        section = section_of(y, self.names, self.scales.volts)
        after, drive = self.run(section, turns * self.size)
        return flat(after, self.scales.volts), self.means(drive)

    @property
    def slow(self) -> Floats:
        """Coordinates, speeds, the piezo's voltage and last that of Csmooth.

        Between them a user's own circuit has the inductors' currents over w0 Cp, and the
        voltages of other capacitors.
        """
        names = self.names
        load = self.device.load
        s = self.scales
        pairs = [load.smoothing_nodes]
        if load.topology is None:
            both = {load.smoothing_nodes, load.smoothing_nodes[::-1], (PIEZO, "0"), ("0", PIEZO)}
            pairs = [
                *dict.fromkeys(pair for pair in stores(load, s.capacitance) if pair not in both),
                *pairs,
            ]
        moving = self.coordinates_and_speeds
        size = moving + len(names)
        at = {name: moving + k for k, name in enumerate(names)}
        slow = [np.eye(1, size, k)[0] for k in (*range(moving), at["p"])]
        for pair in pairs:
            row = np.zeros(size)
            for node, sign in zip(pair, (1.0, -1.0), strict=False):
                if node in at:
                    row[at[node]] += sign
            slow.append(row)
        if load.topology is None:
            coils = [k for name, k in at.items() if COIL.fullmatch(name)]
            slow[moving + 1 : moving + 1] = [
                np.eye(1, size, k)[0] / (s.frequency * s.capacitance) for k in coils
            ]
        return np.array(slow)

    def unbroken(
        self, section: CoupledState, turns: int, times: int
    ) -> tuple[Floats, CoupledState, Drive]:
        """Coordinates and speeds after each of ``times`` turns in one run, (times, 2 n), and its end.

        The means of the excitation leave out the first turn.
        """
        size = turns * self.size
        end, drive = self.run(section, times * size, size, size, size)
        return drive.motion, end, drive

    def wander(self, periods: int) -> int:
        """As of `PeriodMap`."""
        sections, self.section, drive = self.unbroken(self.section, 1, periods)
        return comes_back_after(sections[:, :2], math.sqrt(self.means(drive)[2]))

    def measured(
        self, settled: Settling, turns: int, most: float = COMES_BACK
    ) -> PeriodicResponse | None:
        """The means of an unbroken run from where the map has settled.

        None if that does not come back.

        With ``most``, of the state's size, it must come that near, with all that is left of the
        way.
        """
        scales = self.scales
        sections, section, drive = self.unbroken(
            section_of(settled.state, self.names, scales.volts), turns, 1 + self.repeats
        )
        changed = [drive.nodes[name] - drive.nodes_earlier[name] for name in self.names]
        moving = self.coordinates_and_speeds
        residual = settled.slow[:, moving:] @ np.array(changed) / scales.volts
        residual[:moving] = sections[-1] - sections[-2]
        rest = settled.remainder(residual)
        if rest.size > most:
            settled.state = flat(section, scales.volts)
            return None
        power, square, _ = means = self.means(drive)
        ledger = ledger_of(drive.state[0], scales, drive.smoothing, self.device.load.linear)
        probed = means_of_probes(self.device.probes, drive) if self.device.probes else None
        wave = drive.kicked[-turns * self.size :, [0, 2]]
        quiet = quiet_kick(np.diff(wave[:, 0], append=wave[0, 0]))[1] / self.size
        return PeriodicResponse(
            section,
            self.phase,
            turns,
            secants=settled.secants(WORTH),
            farads=self.farads,
            quiet=quiet,
            power=power,
            square=square,
            ledger=ledger,
            left=rest.shares(means),
            periods=self.mass_steps / self.size,
            steps=self.steps,
            wave=wave,
            probed=probed,
        )

    def returns(self, settled: Settling, turns: int) -> bool:
        """Whether a motion that is pushed aside comes nearer again, some way or, if not, a shorter one."""
        begin = section_of(settled.state, self.names, self.scales.volts)
        # its velocity is that of half a step later, as below
        (there, *_), *_ = self.unbroken(begin, turns, 1)
        least = 2.0 * NOISY * math.sqrt(settled.means[2])
        for far in AWAY[: 1 + (self.start_turns > 1)]:
            way = max(far * math.hypot(begin.x, begin.v), least)
            aside = dataclasses.replace(begin, x=begin.x + 0.6 * way, v=begin.v + 0.8 * way)
            sections, *_ = self.unbroken(aside, turns, self.periods(TRIED, 4))
            if math.hypot(*(sections[-1] - there)) < way:
                return True
        return False


def periodic_response(
    device: CoupledDevice,
    origin: Origin,
    deadline: float,
    enough: float = REACHED,
    near: Neighbour | None = None,
) -> PeriodicResponse | None:
    """The response from ``origin``, or from ``near``, that of an excitation a little different.

    None if it does not come back, even after some periods.  Raises as `run_in_this_process`.
    """
    path = NgspiceMap(device, near or origin, near.farads if near else 0.0, deadline, enough)
    linear = linear_growth(device.eqs) is not None and feeds_nothing(device.load)
    known = near.secants if near else None
    # on its branch, as long as that is there
    stays = near is not None and (not linear or near.quiet > QUIET)
    if near and stays and (response := _settled(path, near.turns, linear, known, linear)):
        return response
    moved = _moves_to_a_quiet_phase(path, near is None)
    known = None if moved else known
    if not linear:
        path.come_near()
    if (response := _settled(path, origin.turns, linear, known, linear)) is not None:
        return response
    again = path.wander(2 * path.longest)
    return _settled(path, again, False) if again else None


def _moves_to_a_quiet_phase(path: NgspiceMap, from_rest: bool) -> bool:
    """Continue to a phase at which the motion is quiet; whether that is another phase."""
    path.section, drive = path.run(
        path.section, path.periods(FIRST if from_rest else 1) * path.size, stride=1
    )
    quiet, away = quiet_kick(drive.contact_speeds[-path.size :])
    if not from_rest and away >= QUIET * path.size:
        return False
    path.section, _ = path.run(path.section, quiet)
    path.phase = (path.phase + quiet / path.size) % 1.0
    return True


def same_response(
    device: CoupledDevice, near: Neighbour, deadline: float, enough: float = REACHED
) -> PeriodicResponse | None:
    """The same response at another step or tolerance; None if it has disappeared."""
    path = NgspiceMap(device, near, near.farads, deadline, enough)
    return _settled(path, near.turns, True, near.secants)


def _settled(
    path: NgspiceMap, turns: int, surely: bool, known: Secants | None = None, fresh: bool = False
) -> PeriodicResponse | None:
    """The response near the section; None if none comes back, and holds unless ``surely``."""
    settled = path.settling(turns, known, STALE if fresh else ALIKE)
    if fresh and settled.reach(ROUGHLY):
        settled.probe()
    if surely and (known is not None or settled.probed) and settled.reach(path.enough, guess=True):
        if response := path.measured(settled, turns, path.enough):
            return response
    elif surely and settled.reach(path.enough) and not settled.probed:
        settled.learn()
    if not settled.reach(path.enough) or not (surely or path.returns(settled, turns)):
        return None
    return path.measured(settled, turns)
