"""A scene's device as a part for circuit simulators: a subcircuit whose pins are the piezo and the base's acceleration.

Force is voltage (1 V = 1 N) and velocity is current (1 A = 1 m/s), so that a loop is the equation
of motion

    M X'' + (c + c2 X^2 + c4 X^4) X' + k X + k2 X^2 + k3 X^3 + theta v = -M a + stops,    Cp v' + i = theta X'

with the mass as a coil, the linear damping as a resistor, the linear spring as a capacitor of 1/k,
and an ideal transformer to the piezo.  Nonlinear parts are behavioural sources of the
displacement, which is the state of the spring's capacitor.  A stop is a spring and a damper while
the mass is behind it.

Further modes are loops like it on the same piezo (`harvester.devices.mode_loops`).
(Tilmans, J. Micromech. Microeng. 6, 157, 1996, for the analogy.)
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from harvester import __version__
from harvester.devices import mode_loops
from harvester.devices.base_motion import MOST_POINTS, base_source, spacing
from harvester.engines.protocol import AnyScene
from harvester.equations.effects import EFFECTS, PART, SEVERAL_MODES
from harvester.equations.from_scene import SOURCES
from harvester.equations.problem import Problem
from harvester.errors import CannotServeError, InputError, invalid, reading
from harvester.machine import files
from harvester.quantities.kinds import TIME, with_prefix
from harvester.quantities.units import SYMBOLS
from harvester.scene.further_modes import contact_mass
from harvester.scene.physical import Stop

STIFFER = 1e5  # stiffness of a rigid stop over the spring's: a contact of half a period/300
LEAST_RESTITUTION = 0.01  # a contact that loses all would never end
PERIODS = 1000.0  # of drawn noise
# steps of the simulator to a point of noise: V^2 within 0.02 %, where one step was up to 0.5 % off
FINER = 4.0
CONTACT_STEPS = 20.0  # steps of the simulator within a contact, at least


def export(
    scene: AnyScene,
    out: str | Path,
    name: str | None = None,
    duration: str | float | None = None,
    seed: int = 0,
) -> str:
    """Write a scene's device as a subcircuit for ngspice, LTspice and KiCad to the file ``out``.

    Returns its name.

    ``name`` is that of the subcircuit; None: that of the file.  ``duration`` (s) and ``seed`` are
    those of noise that is written point by point (coloured, of a band, tabulated); None: 1000
    periods.

    Raises InputError for a nondimensional scene, which is not a device, an invalid name, and a
    file that cannot be written; CannotServeError for noise on the stiffness.
    """
    problem = Problem.of(scene)
    path = Path(out)
    if not path.name or path.is_dir():
        raise invalid("`out`", "be a file, such as device.lib", str(out))
    if isinstance(scene, str | Path) and path.resolve() == Path(scene).resolve():
        raise invalid("`out`", "be another file than the scene", str(out))
    name = re.sub(r"\W", "_", path.stem, flags=re.ASCII) if name is None else name
    if not re.fullmatch(r"[A-Za-z_]\w{0,63}", name, re.ASCII):
        raise invalid("`name`", "be letters, digits and _, and begin with a letter", name)
    files.write(path, part(problem, name, duration, seed))
    return name


@dataclass(frozen=True)
class _Contact:
    """A stop as a spring and a damper (SI units) behind a ``place`` (m).

    ``side`` is 1 below the mass, -1 above.
    """

    name: str
    words: str
    position: float
    side: float
    stiffness: float
    damping: float

    def resistance(self, metre: float, x: str = "v(x)", speed: str = "i(Vspeed)") -> str:
        """The term that it adds to the loop, as an expression of x, of which 1 V is ``metre``, and of its speed."""
        depth = (
            f"({self.position / metre:.10g}-{x})"
            if self.side > 0.0
            else f"({x}-{self.position / metre:.10g})"
        )
        force = f"{-self.side * self.stiffness * metre:.10g}*uramp{depth}"
        return f"{force}+{self.damping:.10g}*{speed}*u{depth}" if self.damping else force


def part(problem: Problem, name: str, duration: str | float | None = None, seed: int = 0) -> str:
    """The text of the file that `export` writes."""
    if not problem.physical:
        raise InputError(
            "the scene must be a device, with [oscillator] and [piezo], but is nondimensional"
        )
    for effect in EFFECTS:
        if effect.is_in(problem.equations) and PART not in effect.known_to:
            key = (
                effect.name
                if effect.name in SEVERAL_MODES
                else SOURCES.get(effect.coefficient, effect.coefficient)
            )
            what = effect.name.replace("_", " ")
            raise CannotServeError(
                f"a part for circuit simulators does not know {what}: leave {key} out"
            )
    length = _duration(duration, problem)
    lines = [
        *_head(problem, name),
        *_device(problem, name),
        "",
        *base_source(problem, name, length, seed),
    ]
    return "\n".join(lines).rstrip() + "\n"


def _duration(duration: str | float | None, problem: Problem) -> float:
    """How long drawn noise is, in s."""
    period = 2.0 * math.pi / problem.scales.frequency
    longest = MOST_POINTS * spacing(problem)
    drawn = problem.equations.coloured is not None or problem.equations.density is not None
    if duration is None:
        return min(PERIODS * period, longest)
    if not drawn:
        raise InputError(
            "`duration` must be used with noise that is drawn point by point, but the scene has none"
        )
    seconds = reading("`duration`", partial(with_prefix, kind=TIME), duration)
    if not period <= seconds <= longest:
        raise invalid("`duration`", f"be between {period:.3g} and {longest:.3g}", duration)
    return seconds


def _head(problem: Problem, name: str) -> Iterator[str]:
    """The description of the file, and its use."""
    scene, s = problem.scene, problem.scales
    title = re.sub(r"[^ -~]", " ", scene.title or name)
    load = scene.load.resistance if scene.load is not None and scene.load.resistance else 1e6
    period = 2.0 * math.pi / s.frequency
    step = spacing(problem) / FINER
    if (contact := _shortest_contact(problem)) is not None:
        step = min(step, contact / CONTACT_STEPS)
    force = s.mass * s.length * s.frequency**2
    yield f"* {title}: a piezoelectric energy harvester as a part, made by harvester {__version__}"
    yield "*"
    yield "* Pins  p, n : the piezo's electrodes"
    yield "*       acc  : the base's acceleration, an input: 1 V is 1 m/s^2"
    yield f"*       x    : the displacement of the mass from the base, an output: 1 V is 1 {_unit(problem)[1]}"
    yield "* Inside, 1 V is a force of 1 N, and 1 A a velocity of 1 m/s."
    yield "*"
    yield "* A bench: the part in the scene's excitation, with a load"
    if scene.excitation is not None:
        yield f"*   Xbase acc {name}_base"
    yield f"*   Xdevice p 0 acc x {name}"
    yield f"*   Rload p 0 {load:.10g}"
    yield f"*   .tran {step:.3g} {100 * period:.3g} 0 {step:.3g} uic"
    yield f"*   .options method=gear reltol=1e-5 vntol={1e-7 * min(force, s.volts):.2g} abstol=1e-15 chgtol=1e-18"
    yield "* A chip or another circuit that switches may need reltol=1e-4: else ngspice ends with Timestep too small"
    if contact is not None:
        yield f"* The last number of .tran is the longest step: a contact with a stop lasts {contact:.3g} s"
    yield ""


def _device(problem: Problem, name: str) -> Iterator[str]:
    """The subcircuit of mass, springs, dampers, stops and piezo."""
    scene, s = problem.scene, problem.scales
    modal = scene.modal
    metre = _unit(problem)[0]
    mass = modal.mass
    stiffness = abs(modal.stiffness)
    damping = modal.damping
    start = problem.equations.resting_places[0] * s.length
    x = f"({metre:.10g}*v(x))"
    speed = "i(Vspeed)"
    nodes = iter(range(1, 100))
    here = next(nodes)

    def ends() -> str:
        nonlocal here
        there = next(nodes)
        pair = f"m{here} m{there}"
        here = there
        return pair

    yield f".subckt {name} p n acc x"
    yield f"* The base's acceleration pushes the mass M = {mass:.10g} kg by -M a"
    yield f"Eforce m{here} 0 acc 0 {-mass:.10g}"
    yield f"* The mass: {mass:.10g} kg as a capacitor, whose voltage is v(speed) and whose current is the force"
    yield "* (a coil would do as well, but LTspice gives every coil a resistance of its own)"
    yield "Hspeed speed 0 Vspeed 1"
    yield f"Cmass speed force {mass:.10g}"
    yield "Vforce force 0 0"
    yield f"Hmass {ends()} Vforce 1"
    if damping:
        yield f"* Its linear damping: {damping:.10g} N s/m as a resistor"
        yield f"Rdamping {ends()} {damping:.10g}"
    for key, power in (("damping_x2", 2), ("damping_x4", 4)):
        if coefficient := getattr(scene.oscillator, key):
            yield f"* Damping of X^{power}: {coefficient:.10g} N s/m^{power + 1}"
            yield f"B{key} {ends()} V={coefficient:.10g}*{'*'.join([x] * power)}*{speed}"
    yield f"* The linear spring: {stiffness:.10g} N/m as a capacitor of 1/k; it begins at {start:.10g} m"
    yield f"Cspring {(spring := ends())} {1.0 / stiffness:.10g} ic={stiffness * start:.10g}"
    yield f"Edisplacement x 0 {spring} {1.0 / (stiffness * metre):.10g}"
    if modal.stiffness < 0.0:
        yield f"* The stiffness is negative, {modal.stiffness:.10g} N/m: minus twice the capacitor's"
        yield f"Bnegative {ends()} V={2.0 * modal.stiffness:.10g}*{x}"
    for key, power in (("quadratic_stiffness", 2), ("cubic_stiffness", 3)):
        if coefficient := getattr(scene.oscillator, key):
            yield f"* The spring's force of X^{power}: {coefficient:.10g} N/m^{power}"
            yield f"B{key} {ends()} V={coefficient:.10g}*{'*'.join([x] * power)}"
    stops = list(_stops(problem))
    if scene.mode and stops:
        yield from mode_loops.contact(scene.mode)
    for stop in stops:
        yield f"* {stop.words}"
        if scene.mode:
            yield f"B{stop.name} {stop.name} 0 V={stop.resistance(metre, mode_loops.AT_STOP, mode_loops.SPEED)}"
            yield f"E{stop.name} {ends()} {stop.name} 0 1"
        else:
            yield f"B{stop.name} {ends()} V={stop.resistance(metre)}"
    yield f"* The piezo: {modal.coupling:.10g} N/V as an ideal transformer, capacitance {modal.capacitance:.10g} F"
    yield f"Epiezo {ends()} p n {modal.coupling:.10g}"
    yield f"Vspeed m{here} 0 0"
    yield f"Fpiezo n p Vspeed {modal.coupling:.10g}"
    yield f"Cpiezo p n {modal.capacitance:.10g}"
    for number, mode in enumerate(scene.mode, 2):
        yield from mode_loops.loop(number, mode, metre, [stop.name for stop in stops])
    yield f".ends {name}"


def _stops(problem: Problem) -> Iterator[_Contact]:
    """The stops of a scene; for a rigid one those that give its restitution coefficient r.

    A linear contact that ends at the point where it began keeps exp(-pi z/sqrt(1 - z^2)) of the
    speed, z its damping ratio.
    """
    scene = problem.scene
    modal = problem.scene.modal
    mass = contact_mass(modal, scene.mode)
    for name, stop, side in (("stop", scene.stop, 1.0), ("opposite", scene.opposite_stop, -1.0)):
        if stop is None:
            continue
        x = 0.0 - side * (stop.gap or 0.0)  # 0, if there is no gap, and not -0
        if isinstance(stop, Stop) and stop.stiffness is not None:
            words = f"A compliant stop at X = {x:.10g} m: {stop.stiffness:.10g} N/m, {stop.damping or 0.0:.10g} N s/m"
            yield _Contact(name, words, x, side, stop.stiffness, stop.damping or 0.0)
            continue
        assert stop.restitution is not None, "the scene checks this"
        hard = STIFFER * abs(modal.stiffness)
        logarithm = -math.log(max(stop.restitution, LEAST_RESTITUTION))
        ratio = logarithm / math.hypot(math.pi, logarithm)
        soft = 2.0 * ratio * math.sqrt(hard * mass)
        kind = f"A rigid stop, r = {stop.restitution:.10g}, at X = {x:.10g} m"
        words = f"{kind}: {hard:.10g} N/m and {soft:.10g} N s/m behind it"
        yield _Contact(name, words, x, side, hard, soft)


def _shortest_contact(problem: Problem) -> float | None:
    """How long the shortest contact with a stop lasts (s); None without a stop."""
    mass = contact_mass(problem.scene.modal, problem.scene.mode)
    times = []
    for stop in _stops(problem):
        square = stop.stiffness / mass - (0.5 * stop.damping / mass) ** 2
        times.append(math.pi / math.sqrt(square))
    return min(times, default=None)


def _unit(problem: Problem) -> tuple[float, str]:
    """The value of 1 V of the displacement, in m and in words: a power of a thousand that suits the device."""
    power = min(max(3 * math.floor(math.log10(problem.scales.length) / 3), -9), 0)
    return 10.0**power, f"{SYMBOLS[power]}m"
