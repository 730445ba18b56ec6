"""`hv.cosimulate`: a model of one's own and ngspice, against closed forms, and what is bad input."""

import math
import pickle
from typing import NamedTuple

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

import harvester as hv
from harvester.cosimulation import Coil, Cosimulation, Piezo, cosimulate
from tests.support.models import Motion, Oscillator, linear, orders

PIEZO = Piezo(coupling="1 mN/V", capacitance="50.2 nF")
PLATE = Oscillator(m=0.04, k=16.0, c=6.4e-3)
MAGNET = Oscillator(m=0.02, k=316.0, c=0.05, moving=1.0)
START = Motion(1e-3, 0.05)


def piezo_matrix(m, resistance):
    theta, farads = PIEZO.coupling, PIEZO.capacitance
    return np.array(
        [
            [0, 1, 0],
            [-m.k / m.m, -m.c / m.m, -theta / m.m],
            [0, theta / farads, -1 / (resistance * farads)],
        ]
    )


def coil_matrix(m, k, ohms, henries):
    if henries is None:
        return np.array([[0, 1], [-m.k / m.m, -(m.c + k * k / ohms) / m.m]])
    return np.array(
        [[0, 1, 0], [-m.k / m.m, -m.c / m.m, -k / m.m], [0, k / henries, -ohms / henries]]
    )


@pytest.mark.ngspice
@pytest.mark.parametrize("inductance", ["piezo", None, 0.05, 1.0])
def test_second_order_on_closed_forms(inductance):
    """A ring-down on a resistor, by a piezo and by a coil whose current follows at once, soon, or late."""
    errors, residuals = [], []
    for n in (400, 800, 1600):
        if inductance == "piezo":
            found = cosimulate(
                PLATE, hv.Load(resistance=1e6), PIEZO, START, 2.0, 2.0 / n, compiled=False
            )
            exact = linear(piezo_matrix(PLATE, 1e6), [START.x, START.v, 0.0], found.time)
        else:
            coil = Coil(coupling=10.0, resistance=100.0, inductance=inductance)
            found = cosimulate(
                MAGNET,
                hv.Load(resistance=400.0),
                coil,
                START,
                0.4,
                0.4 / n,
                tolerance=1e-8,
                compiled=False,
            )
            a = coil_matrix(MAGNET, 10.0, 500.0, inductance)
            exact = linear(a, [START.x, START.v, 0.0][: len(a)], found.time)
        pairs = zip((found.state["x"], found.state["v"]), exact.T, strict=False)
        errors.append(max(np.abs(a - b).max() / np.abs(b).max() for a, b in pairs))
        residuals.append(abs(found.ledger_residual))
    assert min(orders(errors)) > 1.8
    assert errors[-1] < 3e-3
    assert residuals[-1] < 0.35 * residuals[0] and residuals[-1] < 0.003


@pytest.mark.thorough("test_second_order_on_closed_forms")
@pytest.mark.ngspice
@pytest.mark.slow
def test_compiled_and_plain_are_one():
    """To the last digit, with noise, a stop and a bridge; and the same seed is the same path."""
    model = PLATE._replace(noise=1e-4, restitution=0.8)
    runs = [
        cosimulate(
            model, "bridge", PIEZO, START, "1 s", "5 ms", seed=4, probe="store", compiled=one
        )
        for one in (True, False, None)
    ]
    assert [one.compiled for one in runs] == [True, False, True]
    assert runs[0].number_of_events > 3
    for other in runs[1:]:
        assert other == runs[0] or np.array_equal(other.state["x"], runs[0].state["x"])
        assert np.array_equal(other.probes["store"], runs[0].probes["store"])
    third = cosimulate(model, "bridge", PIEZO, START, "1 s", "5 ms", seed=5)
    assert not np.array_equal(third.state["x"], runs[0].state["x"])
    assert max(one.state["miss"].max() for one in runs) < 1e-18  # met to rounding: of 1 mm


@pytest.mark.thorough("test_second_order_on_closed_forms")
@pytest.mark.ngspice
@pytest.mark.slow
def test_white_noise_has_its_stationary_variance():
    """Variances of displacement, velocity and voltage by the Lyapunov equation, |z| < 4 over 100 blocks."""
    model = PLATE._replace(c=0.16, noise=1e-4)
    q = np.zeros((3, 3))
    q[1, 1] = model.noise / model.m**2
    exact = np.diag(solve_continuous_lyapunov(piezo_matrix(model, 1e6), -q))
    found = cosimulate(model, hv.Load(resistance=1e6), PIEZO, Motion(0.0, 0.0), 802.0, 4e-3, seed=1)
    for values, expected in zip(
        (found.state["x"], found.state["v"], found.voltage), exact, strict=True
    ):
        blocks = (values[501:] ** 2).reshape(100, -1).mean(axis=1)
        assert abs(blocks.mean() - expected) < 4.0 * blocks.std() / 10.0
    assert found.mean_power.value == pytest.approx(float((found.voltage**2).mean()) / 1e6, rel=2e-3)
    assert abs(found.ledger_residual) < 0.01


WEAK = [Piezo(coupling=1e-8, capacitance=1e-8), Coil(coupling=1e-3, resistance=100.0)]


@pytest.mark.ngspice
@pytest.mark.parametrize("step", [0.023, 0.06])  # below and above the time between impacts
@pytest.mark.parametrize("port", WEAK, ids=["piezo", "coil"])
def test_a_drop_on_a_stop(port, step):
    """A mass falls on a stop: its impacts come at the times of free fall, whatever the step, and at the stop itself."""

    class Falling(Oscillator):
        def kick(self, s, h, reaction, noise):
            return Motion(s.x, s.v - h * (9.81 + reaction / self.m), s.miss)

    model = Falling(m=0.05, k=0.0, c=0.0, restitution=0.7, moving=float(isinstance(port, Coil)))
    load = hv.Load(resistance=1e9)
    found = cosimulate(model, load, port, Motion(0.05, 0.0), "0.48 s", step, compiled=False)
    first = math.sqrt(2 * 0.05 / 9.81)
    times = first + 2 * first * np.cumsum([0.0, *(0.7**k for k in range(1, 8))])
    expected = times[times < 0.48]
    # of a coil the first kick is a millionth of a step late
    assert found.events == pytest.approx(expected, rel=5e-5 * step)
    assert found.state["miss"].max() < 1e-15


@pytest.mark.ngspice
def test_the_answer_is_data():
    found = cosimulate(
        PLATE,
        "bridge",
        PIEZO,
        START,
        "100 ms",
        "5 ms",
        probe=["store", "i(d1)"],
        every=2,
        compiled=False,
    )
    assert isinstance(found, Cosimulation)
    assert found.time == pytest.approx(np.arange(11) * 0.01)
    assert {*found.to_xarray().data_vars} >= {
        "x",
        "v",
        "voltage",
        "current",
        "load_power",
        "store",
        "i(d1)",
    }
    assert found.to_pandas().shape == (11, 9)
    assert repr(found).startswith("Cosimulation(duration=100 ms, step=5 ms, mean_power=")
    assert len(repr(found)) < 200
    assert len(found.plot().axes) == 8
    assert pickle.loads(pickle.dumps(found)) == found
    assert (found.state["x"][0], found.voltage[0]) == (START.x, pytest.approx(0.0, abs=1e-3))


TEXT = "* mine\n.subckt mine a b R=1Meg\nRload a b {R}\nC1 a b 1n\n.ends"


@pytest.mark.ngspice
def test_a_circuit_may_be_a_text_or_a_file(tmp_path):
    path = tmp_path / "mine.cir"
    path.write_text(TEXT)
    given = (TEXT, str(path), hv.Load(netlist=str(path), parameters={"R": 1e6}))
    a, *others = (
        cosimulate(PLATE, one, PIEZO, START, "50 ms", "5 ms", compiled=False) for one in given
    )
    assert all(np.array_equal(a.voltage, one.voltage) for one in others)


class Wrong(NamedTuple):
    """A model of which one function is replaced."""

    way: float = 0.0

    def drift(self, s, h):
        return Motion(s.x + h * s.v, s.v, s.miss + h)

    def kick(self, s, h, reaction, noise):
        return Motion(s.x, s.v - h * reaction, s.miss)

    def source(self, s):
        return s.x


def wrong(**functions):
    """An object of a class that has them in the place of its own; None removes one."""
    kept = {
        name: one
        for name, one in (vars(Wrong) | functions).items()
        if name in ("drift", "kick", "source")
    }
    more = {name: one for name, one in functions.items() if name in ("event", "jump")}
    return type("Mine", (), {name: one for name, one in (kept | more).items() if one is not None})()


def late(value):
    """An event's time that is wrong after 20 ms."""
    return lambda self, s, h: value if s.miss > 0.02 else None


BAD = {
    "model` must have the functions drift, kick, source, but 'Mine' has no source": {"model": wrong(source=None)},
    "model` must have the functions event, jump, but 'Mine' has no jump": {"model": wrong(event=late(0.0))},
    "model` must be an object": {"model": Wrong},
    "must take (state, h, reaction, noise), but is '(s, h)'": {"model": wrong(kick=lambda self, s, h: s)},
    "model.drift` must give a Motion of finite": {"model": wrong(drift=lambda self, s, h: s._replace(v=math.nan))},
    "model.drift` must give a Motion of numbers, as `start` is": {"model": wrong(drift=lambda self, s, h: (s.x, s.v))},
    "model.source` must give a finite number, but is 'x'": {"model": wrong(source=lambda self, s: "x")},
    "from 0 to 0.005 s, or None, but is -1": {"model": wrong(event=lambda self, s, h: -1, jump=lambda self, s: s)},
    "start` must be a NamedTuple of finite numbers": {"start": (1e-3, 0.05, 0.0)},
    "start` must have no number of the name": {"start": NamedTuple("Odd", [("time", float)])(0.0), "model": "odd"},
    "port` must be a Piezo or a Coil, but is 'coil'": {"port": "coil"},
    "such as '10 V s/m', above 0, but is '1 kg'": {"port": lambda: Coil(coupling="1 kg")},
    "duration` must be a time above 0, such as 0.001 or '1 ms', but is '1 kg'": {"duration": "1 kg"},
    "every` must be a whole number from 1 to 20": {"every": 21},
    "unknown netlist 'brige': did you mean 'bridge'?": {"circuit": "brige"},
    "must use its terminal 'a', but no element": {"circuit": TEXT.replace(" a b", " x b").replace("mine x", "mine a")},
    "include a file in the netlist's folder": {"circuit": TEXT.replace("C1 a b 1n", ".include /etc/passwd")},
    "have only the cards": {"circuit": TEXT.replace("C1 a b 1n", ".control")},
    "unknown node of netlist mine 'q'": {"circuit": TEXT, "probe": "v(q)"},
    "unknown argument of cosimulate 'sted': did you mean 'step'?": {"sted": 1},
    "model` must be a NamedTuple of numbers for `compiled`=True": {"model": wrong(), "compiled": True},
}  # fmt: skip


@pytest.mark.parametrize("told", BAD)
def test_bad_input(told):
    """One line, that names the argument, the expected value and the value; nothing is run."""
    given = {
        "model": Wrong(),
        "circuit": "bridge",
        "port": PIEZO,
        "start": START,
        "duration": 0.1,
        "step": "5 ms",
    }
    given |= BAD[told]
    if given["model"] == "odd":
        given["model"] = wrong(
            drift=lambda self, s, h: s, kick=lambda self, s, h, r, n: s, source=lambda self, s: 0.0
        )
    with pytest.raises(hv.InputError) as error:
        cosimulate(**(given | ({"port": given["port"]()} if callable(given["port"]) else {})))
    assert told in str(error.value)
    assert "\n" not in str(error.value)


class Failing(Wrong):
    """A model that fails after 20 ms, in its own ``way``."""

    def drift(self, s, h):
        return Motion(
            s.x + h * s.v if s.miss < 0.02 or self.way != 1.0 else math.nan, s.v, s.miss + h
        )

    def event(self, s, h):
        if s.miss > 0.02 and self.way >= 2.0:
            return -h if self.way == 2.0 else 0.0
        return None

    def jump(self, s):
        return s


@pytest.mark.ngspice
@pytest.mark.slow
@pytest.mark.parametrize("compiled", [True, False])
def test_what_fails_on_the_way_is_one_line(compiled):
    """It states which function, when, and in which state; the next run is as good as ever."""
    told = (
        "model.drift` must give finite numbers",
        "model.event` at 0.025 s",
        "model.event` must come to an end",
    )
    for way, words in enumerate(told, 1):
        with pytest.raises(hv.InputError) as error:
            cosimulate(
                Failing(float(way)),
                "resistor",
                PIEZO,
                Motion(1e-3, 0.0),
                0.1,
                "5 ms",
                compiled=compiled,
            )
        assert words in str(error.value) and "\n" not in str(error.value)
    assert (
        cosimulate(
            Failing(), "resistor", PIEZO, Motion(1e-3, 0.0), 0.1, "5 ms", compiled=compiled
        ).steps
        > 20
    )


@pytest.mark.thorough("test_what_fails_on_the_way_is_one_line")
@pytest.mark.ngspice
@pytest.mark.slow
def test_an_error_inside_a_model_is_its_authors():
    """It comes through as it is, in plain Python; what numba does not compile is named."""

    with pytest.raises(ZeroDivisionError):
        cosimulate(wrong(drift=lambda self, s, h: Motion(s.x, s.v, round(s.miss + h, 9)),
                         kick=lambda self, s, h, r, n: Motion(s.x, 1.0 / round(0.02 - s.miss, 6), s.miss)),
                   "resistor", PIEZO, Motion(1e-3, 0.0), 0.1, "5 ms")  # fmt: skip

    class Odd(Wrong):
        def source(self, s):
            return float(sorted([str(s.x)])[0])

    with pytest.raises(
        hv.InputError, match=r"`model` must be such that numba compiles it, .*`compiled`=False"
    ):
        cosimulate(Odd(), "resistor", PIEZO, Motion(1e-3, 0.0), 0.1, "5 ms")
    assert (
        cosimulate(Odd(), "resistor", PIEZO, Motion(1e-3, 0.0), 0.1, "5 ms", compiled=False).steps
        > 19
    )
