"""The harvesting chips and the self-powered SSHI at a fixed displacement amplitude, in ngspice alone.

Voc is the amplitude of the open-circuit voltage.  The bridge of a chip brings the charge 4 Cp (Voc - V - 2 Vd) a period
into a store at V, so that times to wake up and powers have closed forms; the hard cases end, and stay within bounds.
"""

import math
import re
import subprocess
from itertools import pairwise

import numpy as np
import pytest

from harvester.netlists.load_circuit import netlist_folder
from tests.support.netlists import original

pytestmark = pytest.mark.ngspice

CP, W = 50e-9, 300.0
VREG = 3.3
CHIPS = {
    "ltc3588": ("store", "out", "com"),
    "bq25570": ("store", "out", "com"),
    "self_powered_sshi": ("a", "a", "b"),
}


def traces(name, voc, end, more=(), step=0.4e-3, **given):
    """Times, voltages of store and output, those of other nodes, and the load's power, from empty, by ngspice -b."""
    store, out, com = (f"xload.{node}" for node in CHIPS[name])
    seen = [
        f"v({store})-v({com})",
        f"v({out})-v({com})",
        *(f"v(xload.{one})-v({com})" for one in more),
    ]
    deck = [
        "a piezo at a fixed displacement amplitude",
        f"Vdrive drive 0 SIN(0 {voc!r} {W / (2 * math.pi)!r})",
        f"Cp drive p {CP!r}",
        f"Xload p 0 {name} " + " ".join(f"{k}={v!r}" for k, v in given.items()),
        original(name),
        ".options method=gear maxord=2 reltol=1e-4",
        ".control",
        "set width=250",
        "set nobreak",
        "save all @r.xload.rload[p]",
        f"tran {step!r} {end!r} 0 {step!r} uic",
        f"print col time {' '.join(seen)} @r.xload.rload[p]",
        ".endc",
        ".end\n",
    ]
    done = subprocess.run(
        ["ngspice", "-b", "/dev/stdin"],
        input="\n".join(deck),
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    rows = [row.split()[1:] for row in done.stdout.splitlines() if re.match(r"\d+\t", row)]
    assert rows, done.stdout[-2000:] + done.stderr[-2000:]
    found = np.array(rows, dtype=float).T
    assert np.isfinite(found).all()
    assert found[0, -1] == pytest.approx(end, rel=1e-3)  # it came to the end
    return found


def mean(t, y, begin):
    """The mean of y(t) from a time on."""
    here = t >= begin
    return np.trapezoid(y[here], t[here]) / (t[-1] - t[here][0])


def rises(t, y, level):
    """The times at which y(t) passes a level from below."""
    return t[1:][(y[1:] >= level) & (y[:-1] < level)]


def test_a_step_down_chip_wakes_and_sleeps_as_its_closed_form():
    """First wake tau ln(V/(V - Vrise)); then load and store share the source: P eta R/Vreg^2 of the time is on."""
    voc = 12.0
    r = 5e3
    c = 4e-6
    t, store, out, power = traces("ltc3588", voc, 1.2, R=r, C=c, Cout=0.1e-6)
    tau = math.pi * c / (2 * W * CP)
    # two drops at half of the peak current
    top = voc - 2 * 0.02585 * math.log(CP * W * voc / 2 / 4.4e-9)
    wakes = rises(t, out, 0.9 * VREG)
    assert wakes[0] == pytest.approx(tau * math.log(top / (top - 5.05)), rel=0.03)
    sleeps = rises(t, -out, -0.9 * VREG)
    assert sleeps[0] > wakes[0]
    source = 2 * W * CP / math.pi
    on = [mean(t[(t >= a) & (t <= b)], store[(t >= a) & (t <= b)], a) for a, b in pairwise(wakes)]
    v = float(np.mean(on))  # the store's mean voltage over a cycle
    given = source * (top - v) * v - 0.6e-6 * v
    cycles = (t >= wakes[0]) & (t <= wakes[-1])
    assert len(wakes) > 5
    assert mean(t[cycles], power[cycles], 0.0) == pytest.approx(0.85 * given, rel=0.06)
    assert store.max() < 5.05 + 0.05
    assert store[t > wakes[0]].min() > 3.67 - 0.1


@pytest.mark.thorough("test_efficiency_of_the_output_follows_the_data_sheet")
@pytest.mark.parametrize(
    ("voc", "given", "low", "high"),
    [
        (0.05, {}, 0.0, 0.05),  # hardly any input: nothing wakes
        # a load and an output capacitor much heavier than store and source
        (12.0, {"R": 10.0, "C": 1e-7}, 0.0, 5.2),
        (400.0, {"R": 1e9, "C": 1e-6}, 19.5, 21.0),  # too much input: the shunt takes it
        (12.0, {"R": 5e3, "C": 1e-2}, 0.0, 0.1),  # a store that takes for ever
    ],
)
def test_hard_cases_of_a_step_down_chip(voc, given, low, high):
    _, store, out, _ = traces("ltc3588", voc, 0.6, **given)
    assert low - 1e-6 <= store[-1] <= high
    assert store.min() > -1e-3
    assert -1e-3 < out.min() <= out.max() < VREG + 0.01


def test_a_step_up_chip_holds_its_input_and_gives_what_it_says():
    """The input is at half of the voltage of a look, and the load gets both efficiencies of a bridge's power there."""
    voc, r = 5.0, 20e3
    t, store, out, vin, power = traces(
        "bq25570",
        voc,
        1.6,
        ("in",),
        R=r,
        C=2.2e-6,
        Cout=1e-6,
        Cin=0.2e-6,
        etacold=0.5,
        every=1.0,
        look=0.1,
    )
    woken = rises(t, out, 1.6)
    begin = woken[0]
    assert 2.65 < np.interp(begin, t, store) < 3.05  # some of it went into the output
    assert len(woken) > 3
    cycles = (t >= woken[1]) & (t <= woken[-1])
    held = np.median(vin[cycles])
    drops = 2 * 0.02585 * math.log(CP * W * voc / 2 / 0.1e-6)
    assert held == pytest.approx(0.5 * (voc - drops), rel=0.05)
    # the look takes a tenth of the time
    given = 2 * W * CP / math.pi * held * (voc - held - drops) * 0.9
    assert mean(t[cycles], power[cycles], 0.0) == pytest.approx(0.8 * 0.9 * given, rel=0.15)
    assert store[t > begin].min() > 2.4 - 0.1
    assert out.max() < 1.85
    # the first when the cold start has ended, the second 1 s later
    looks = rises(t, vin, 0.95 * (voc - drops))
    assert len(looks) == 2
    assert looks[1] - looks[0] == pytest.approx(1.0, abs=0.03)


@pytest.mark.thorough("test_efficiency_of_the_output_follows_the_data_sheet")
def test_a_step_up_chip_stops_charging_when_full():
    _, store, _, _ = traces(
        "bq25570", 4.0, 0.5, R=1e9, C=0.5e-6, Cin=0.2e-6, Cout=0.1e-6, etacold=0.5, look=0.1
    )
    assert 4.15 < store[-1] < 4.25
    assert store.max() < 4.25


@pytest.mark.thorough("test_efficiency_of_the_output_follows_the_data_sheet")
@pytest.mark.parametrize(
    ("voc", "given", "low", "high"),
    [
        (0.05, {}, 0.0, 1e-3),
        (400.0, {"R": 1e9, "C": 1e-4}, 0.5, 4.25),
        (5.0, {"R": 10.0, "C": 1e-7, "etacold": 0.5, "look": 0.05}, 0.0, 4.25),
    ],
)
def test_hard_cases_of_a_step_up_chip(voc, given, low, high):
    _, store, out, vin, _ = traces("bq25570", voc, 0.4, ("in",), **given)
    assert low - 1e-6 <= store[-1] <= high
    assert min(store.min(), vin.min(), out.min()) > -0.05
    assert vin.max() < 6.0  # the clamp
    assert out.max() < 1.85


@pytest.mark.parametrize(
    ("amps", "efficiency"), [(0.9e-6, 0.4), (4e-6, 0.73), (32e-6, 0.88), (512e-6, 0.93)]
)
def test_efficiency_of_the_output_follows_the_data_sheet(amps, efficiency):
    """The store at 3.6 V gives the output's power over the efficiency, and the chip's own current."""
    parts = (netlist_folder() / "parts" / "bq25570.lib").read_text()
    deck = [
        "the output at a current",
        f"Vs store 0 3.6\nRin in 0 1Meg\nCout out 0 1u\nIload out 0 {amps!r}\nX1 in store out 0 bq25570_chip Iq=0",
        parts,
        ".options reltol=1e-6",
        ".control\ntran 1m 0.2 0 1m uic\nlet n = length(time)-1\nprint i(vs)[n] v(out)[n]\n.endc\n.end\n",
    ]
    done = subprocess.run(
        ["ngspice", "-b", "/dev/stdin"],
        input="\n".join(deck),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    current, volts = (float(one) for one in re.findall(r"^\S+ = (\S+)$", done.stdout, re.M))
    assert volts * amps / (-3.6 * current) == pytest.approx(efficiency, rel=0.01)
    assert volts == pytest.approx(1.8, abs=0.01)


@pytest.mark.parametrize(("share", "low"), [(0.5, 0.9), (2.0, 0.7)])
def test_self_powered_sshi_against_its_closed_form(share, low):
    """An upper bound, near at small loads, and far above the power of a bridge at best."""
    voc = 20.0
    cp = CP
    cpeak = 2e-9
    r = share * math.pi / (W * cp)
    t, _, _, power = traces("self_powered_sshi", voc, 0.9, step=0.1e-3, R=r, C=8 * math.pi / W / r)
    ct = cp + 2 * cpeak
    z = math.sqrt(1.0 / (cp + 2 * cpeak))
    q = math.exp(-math.pi / 2 * (300 / z + z / 500e3))
    drops = (1 + q) * 1.1 + 2 * (1 - q) * 0.55 + (1 + q) * 0.75
    bound = (2 * cp * voc - ct * drops) / (ct * (1 - q) + math.pi / (W * r))
    found = mean(t, power, 0.6)
    assert low * bound**2 / r < found < 1.02 * bound**2 / r
    assert found > 2.0 * W * cp * voc**2 / (2 * math.pi)


def test_self_powered_sshi_does_not_switch_below_its_drops():
    """At 0.8 V no emitter is ever forward: what is left is less than the bridge's best power."""
    t, _, _, power = traces("self_powered_sshi", 0.8, 0.3, R=1e6, C=1e-8)
    assert mean(t, power, 0.2) < W * CP * 0.8**2 / (2 * math.pi)


@pytest.mark.thorough("test_efficiency_of_the_output_follows_the_data_sheet")
@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("ltc3588", 0.2, 0.5),
        ("bq25570", 0.2, 2.0),
        ("self_powered_sshi", 3.4, 4.4),
        ("node", 0.01, 0.11),
        ("sshc", 0.22, 0.242),
    ],
)
def test_their_files_run_by_hand(name, low, high):
    """The power (mW) that `ngspice -b` prints of each file as it is."""
    path = netlist_folder() / f"{name}.cir"
    said = subprocess.run(
        ["ngspice", "-b", path], capture_output=True, text=True, timeout=60, check=False
    ).stdout
    assert low < 1e3 * float(said.split("load_power")[1].split()[1]) < high


def node_current(volts, end, **given):
    """Times and the current of a sensor node at a supply, given as ngspice's source."""
    more = " ".join(f"{key}={value!r}" for key, value in given.items())
    deck = [
        "a node",
        f"Vs supply 0 {volts}",
        f"X1 supply 0 sensor_node {more}",
        (netlist_folder() / "parts" / "sensor_node.lib").read_text(),
        ".options reltol=1e-4 method=gear",
        f".control\nset nobreak\ntran 0.2m {end!r} 0 0.2m uic\nlet y = -i(vs)\nprint col time y\n.endc\n.end\n",
    ]
    done = subprocess.run(
        ["ngspice", "-b", "/dev/stdin"],
        input="\n".join(deck),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    rows = [row.split()[1:3] for row in done.stdout.splitlines() if re.match(r"\d+\t", row)]
    return np.array(rows, dtype=float).T


def test_a_node_takes_the_mean_of_its_table():
    """Over four cycles of 0.1 s: the trapezoids of the table, and the sleep current."""
    t, current = node_current("3", 0.402, every=0.1)
    table = np.array(
        [[0.0, 4e-3], [10e-3, 4e-3], [10.5e-3, 20e-3], [15.5e-3, 20e-3], [16e-3, 2e-6], [0.1, 2e-6]]
    ).T
    charge = np.trapezoid(table[1], table[0])
    cycles = (t >= 0.0015) & (t <= 0.4015)
    assert np.trapezoid(current[cycles], t[cycles]) == pytest.approx(4 * charge, rel=0.02)
    assert len(rises(t, current, 10e-3)) == 4
    assert current.max() == pytest.approx(20e-3, rel=0.01)


@pytest.mark.thorough("test_efficiency_of_the_output_follows_the_data_sheet")
def test_a_node_stops_below_its_supply_and_begins_anew():
    """The supply fails from 20 to 60 ms: nothing meanwhile, and the profile from its beginning afterwards."""
    t, current = node_current("PWL(0 3 20m 3 21m 1 60m 1 61m 3)", 0.09, every=1.0)
    assert np.interp(0.012, t, current) == pytest.approx(20e-3, rel=0.01)
    assert current[(t > 0.025) & (t < 0.058)].max() < 1e-6
    (again,) = rises(t[t > 0.05], current[t > 0.05], 10e-3)
    assert again == pytest.approx(0.0605 + 0.0102, abs=2e-3)
