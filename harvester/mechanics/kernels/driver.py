"""Questions of a driver to any mechanics and any load, answered by the types of both.

A driver is written once, for a recorded path (`harvester.mechanics.trace`) and for many
trajectories (`harvester.mechanics.kernels.trajectory_batch`). It asks the questions below about the
state, the coefficients ``c`` and the ``load``, and is compiled with the answers for their types
(`harvester.mechanics.kernels.compiled.version_of`):

    one mode            `Coefficients`                   `harvester.mechanics.kernels.one_mode`
    several modes       `ModalCoefficients`              `harvester.mechanics.modes.modal_driver`

    resistor            None, as c has its mu            both files
    ideal circuit       `IdealLoad`, `IdealCircuit`      both files
    compiled circuit    `NetlistLoad`, `NetlistLoads`    `harvester.circuits.circuit_batch`

The first type of a load is for one trajectory, the second, if there is one, for many.

The states of many, ``z``, are one array of shape (rows x BATCH,): the n coordinates y, their speeds
v, V, then U of a circuit, and m of an ideal one.  Places that differ by constants are known to the
compiler not to be the same, so that loops over trajectories become vector instructions.  A state
``s`` is a `State` of numbers, or the number of the trajectory whose rows of z it is: a tuple that
holds an array would count references in these loops.

A further load is a type with its answers to `drifted`, `aside` and `noted` on a path, and to
`drifted`, `load_at` and `load_aside` among many; a further mechanics answers the questions without
a load.  Neither changes a driver.
"""

from harvester.mechanics.kernels.coefficients import BATCH
from harvester.mechanics.kernels.compiled import forced, otherwise
from harvester.mechanics.kernels.noise import draw_noise


def oscillator(c):
    """The coefficients of the oscillator among those of the mechanics."""


def coordinates(c):
    """How many coordinates the mechanics has."""


def drifted(s, z, d, c, a, load):
    """The state and the load after the interval d, with the `Impacts`; a is the mean excitation.

    An interval shorter than its step leads aside, to mid-drift (`aside`).
    """


def kicked(s, z, xi, h, c, a, other=None):
    """The state after a kick of length h with the variate xi and the excitation a.

    ``other`` is as of `harvester.mechanics.kernels.equation_of_motion.impulse`.
    """


def beside(s, z, room, c):
    """A copy of the state, to drift on its own; rows of z are copied to ``room``."""


def read(s, z, c):
    """Displacement, velocity and voltage of a state."""


def speed(s, z, c):
    """The speed along which the base shakes."""


@otherwise
def unnamed(s, c):
    """The state for Python, not a NamedTuple: Numba would call its class, which ^C makes a crash."""
    return s


def state_at(i, z, c):
    """The state of trajectory i of z."""


def put(i, z, s, c):
    """Write a state to trajectory i of z."""


def add_sample(i, sums, s, z, mid, z_mid, c):
    """Add up the states s at a kick and ``mid`` in the drift after it."""


def aside(load):
    """A copy of the load, to drift on its own."""


def noted(load, mid, row):
    """Note a sample of the load, at the kick and in ``mid`` drift, in its own records."""


def load_at(i, z, c, load, driven):
    """The load of trajectory i, as `drifted` receives it."""


def load_aside(i, z, mid, c, load):
    """A copy of it, for the states ``mid``."""


def add_to_controls(i, z, s, xi, other, kick_sums, controls, c, load):
    """Add the noise of a kick from the state s to the controls."""


@otherwise
def put_load(i, z, sums, changed, c, load):
    """Write the ``changed`` load of trajectory i to its place, and its counts to the sums."""
    return


@otherwise
def add_load_sample(i, sums, z, mid, c, load):
    """Add up the load at a kick, whose state is in z, and in ``mid`` drift."""
    return


@otherwise
def energy_of(did, c, load):
    """The energy of `Impacts`, or its square of the speed if that is the unit of their sum."""
    return did.energy


@otherwise
def drift_all(z, driven, accelerations, d, c, load, shaker):
    """Drift all trajectories ahead of `drifted`, if that makes loops of vector instructions."""
    return


@otherwise
def drift_all_aside(z, mid, driven, accelerations, d, c, load, shaker):
    """The same from their last kick on, from copies ``mid``."""
    return


@otherwise
def conductance(c, load):
    """None for an open circuit, whose voltage follows the displacement; else a number."""
    return 1.0


@forced
def draw_once(b, noise, doublings, c):
    """Draw one noise of two steps, or of a doubled one; c are the oscillator's coefficients."""
    if c.n1 is not None or c.n2 is not None:
        draw_noise(noise, b.s0, b.s1, doublings)


@otherwise
def draw(b, z, noise, other, before, kick_sums, doublings, c, load, update):
    """Draw the noise of two steps, or of a doubled one, and begin the controls of a draw."""
    draw_once(b, noise, doublings, oscillator(c))


@otherwise
def other_variate(k, i, other, c, load, update):
    """The variate of a further noise in step k of a draw; None if the draw has one noise."""
    return


@otherwise
def end_draw(controls, before, kick_sums, c, load):
    """Add the sums of a draw's kicks to the controls."""
    return


@otherwise
def moving(schedule, load):
    """How many of the trajectories of a batch are advanced."""
    return BATCH


@otherwise
def is_given_up(sums, load, ahead):
    """Whether a batch ends early, with so many steps of trajectories ``ahead``."""
    return False
