"""A response to a steady excitation that does not repeat: the answer of sampled runs, or its refusal, names a cause."""

import pytest

import harvester as hv
from harvester.engines.not_periodic import not_periodic
from harvester.engines.spice.estimates import partial_answer
from harvester.equations.problem import Problem
from harvester.errors import OutOfTimeError

BRIDGE = """* a board
.model DSK D(Is=1u N=1.05 Rs=2 Cjo=20p)
.model relay SW(Ron=1k Roff=1G Vt=3 Vh=1.5)
D1 PZ1 OUT DSK
D2 PZ2 OUT DSK
D3 0 PZ1 DSK
D4 0 PZ2 DSK
C1 OUT 0 {store}
{load}
.end
"""
LOAD = "R1 OUT 0 220k"
RELAY = "S1 OUT C OUT 0 relay\nR1 C 0 10k"
NEGATIVE = f"{LOAD}\nB1 OUT 0 I=1e-9*v(OUT)^3"


def scene(folder, store, load, **oscillator):
    """The device of 8 g at 60 Hz, with a bridge, its storage capacitor and its load."""
    path = folder / "board.cir"
    path.write_text(BRIDGE.format(store=store, load=load))
    return hv.Scene(
        oscillator=hv.Oscillator(mass="8 g", frequency="60 Hz", damping_ratio=0.012, **oscillator),
        piezo=hv.Piezo(coupling="1.5 mN/V", capacitance="47 nF"),
        excitation=hv.Excitation(acceleration_amplitude="0.2 g", frequency="60 Hz"),
        load=hv.Load(netlist=str(path), terminals=["PZ1", "PZ2"], resistor="R1", store="C1"),
    )


STORE_SETTLES = (
    "the storage capacitor settles in 1 h 20 min; 'harvester charge' computes its way up"
)
RHYTHM = "a switch of the netlist may have a rhythm of its own"
INITIAL = "the runs begin at IC= or .ic, which may be far from the steady state; leave it out"


@pytest.mark.parametrize(
    ("store", "load", "more", "told"),
    [
        ("22m", LOAD, {}, STORE_SETTLES),
        ("2.2u", RELAY, {}, RHYTHM),
        ("2.2u IC=5", LOAD, {}, INITIAL),
        ("2.2u", f"{LOAD}\n.ic v(OUT)=2", {}, INITIAL),
        ("22m IC=5", LOAD, {}, f"{STORE_SETTLES}; {INITIAL}"),
        ("2.2u", NEGATIVE, {}, "transistors or controlled sources of the netlist may oscillate"),
        ("2.2u", LOAD, {"cubic_stiffness": "1e9 N/m^3"}, "nonlinear mass or one that hits a stop"),
    ],
)
def test_the_likely_cause_is_named(tmp_path, store, load, more, told):
    remark = not_periodic(Problem.of(scene(tmp_path, store, load, **more)))
    start = "no response repeats within 8 periods of the excitation, so runs are sampled: "
    assert str(remark).startswith(start) and told in str(remark)


@pytest.mark.parametrize("store", ["2.2u", "2.2u IC=0"])
def test_a_board_without_a_likely_cause_names_none(tmp_path, store):
    remark = not_periodic(Problem.of(scene(tmp_path, store, LOAD)))
    assert str(remark) == (
        "no response repeats within 8 periods of the excitation, so runs are sampled"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("store", "load", "told"),
    [
        ("22m", LOAD, STORE_SETTLES),
        ("2.2u", RELAY, RHYTHM),
        ("2.2u IC=5", RELAY, f"{RHYTHM}; {INITIAL}"),
    ],
)
def test_a_refused_time_average_names_the_likely_cause(tmp_path, monkeypatch, store, load, told):
    monkeypatch.setattr("harvester.engines.compiled.LONGEST_SAMPLING", 2.0)
    with pytest.raises(hv.SimulationError, match="`budget` of more than") as refused:
        hv.Compiled().run(scene(tmp_path, store, load))
    assert str(refused.value).endswith(told)


@pytest.mark.ngspice
@pytest.mark.slow
def test_ngspices_time_average_names_it_too(tmp_path, monkeypatch):
    """In its budget the relay's runs end, or a part of one gives the mean: both name the switch."""
    monkeypatch.setattr("harvester.engines.spice.spice.steady_response", lambda *_: None)
    try:
        answer = hv.Spice(budget=6.0).run(scene(tmp_path, "2.2u", RELAY))
    except hv.SimulationError as error:
        assert str(error).endswith(RHYTHM)
    else:
        assert any(RHYTHM in str(remark) for remark in answer.diagnostics)


def test_a_mean_while_a_store_settles_names_the_store(tmp_path):
    problem = Problem.of(scene(tmp_path, "22m", LOAD))
    error = OutOfTimeError("ngspice stopped")
    error.so_far = (1e-6, 2.0, 0.5)
    (remark,) = partial_answer("spice", problem, error, 1.0).diagnostics
    assert str(remark).endswith(STORE_SETTLES)
