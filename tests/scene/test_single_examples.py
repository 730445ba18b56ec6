"""`harvester keys KEY`: each example, as printed, is read in a scene that has only the keys that it needs."""

import json

import pytest

import harvester as hv
from harvester.scene.keys import SEVERAL, keys

EXAMPLES = {f"{key.table}.{key.name}": key.example for key in keys()}


def _of(table, names):
    return {f"{table}.{name}" for name in names.split()}


DEVICE = {
    *_of("oscillator", "mass stiffness damping_ratio"),
    *_of("piezo", "coupling capacitance"),
    *_of("excitation", "acceleration_psd"),
    *_of("load", "resistance"),
}
NODE = {
    *_of("node", "wake_voltage stop_voltage interval currents durations"),
    "storage.capacitance",
    "load.netlist",
}
# the keys that all of a table need, beyond the device's and the needed ones of their table
OF_TABLE = {
    "opposite_stop": {"stop.restitution", "opposite_stop.gap"},
    "storage": {"storage.capacitance"},
    "node": NODE,
    "chip": NODE | _of("chip", "start_voltage stop_voltage"),
    "nondimensional": _of("nondimensional", "c1 beta mu D11"),
}
# the keys that one key needs, and the keys that it stands instead of
OF_KEY = {
    "stop.gap": {"stop.restitution"},
    "stop.damping": {"stop.stiffness"},
    "magnifier.gap": {"magnifier.restitution"},
    "node.packet_energy": {"node.supply_voltage"},
    "node.efficiency": {"node.supply_voltage"},
    "node.retries": {"node.lost_share"},
    "chip.efficiency": {"chip.name"},
    "chip.efficiency_table": {"chip.name"},
    "excitation.level": {"excitation.profile"},
    "load.parameters": {"load.netlist"},
    "nondimensional.gap": {"nondimensional.restitution"},
    "nondimensional.stop_damping": {"nondimensional.stop_stiffness"},
    "nondimensional.eps2": {"nondimensional.D22"},
    "nondimensional.D12": {"nondimensional.D22"},
}
for pair in (
    _of("storage", "diffusion_capacitance diffusion_resistance"),
    _of("storage", "battery_voltage battery_charge"),
    _of("node", "low_voltages low_interval"),
    _of("excitation", "acceleration_amplitude frequency"),
    _of("excitation", "centre_frequency bandwidth"),
    _of("chip", "input_ratio full_voltage"),
    _of("nondimensional", "restitution opposite_restitution opposite_gap"),
    _of("nondimensional", "drive drive_frequency"),
    _of("nondimensional", "centre_frequency bandwidth"),
):
    OF_KEY |= {key: pair - {key} for key in pair}
INSTEAD = {
    "oscillator.frequency": {"oscillator.stiffness"},
    "oscillator.damping": {"oscillator.damping_ratio"},
    "oscillator.q": {"oscillator.damping_ratio"},
    "piezo.open_circuit_frequency": {"piezo.coupling"},
    "load.netlist": {"load.resistance"},
    "storage.battery_voltage": {"storage.capacitance"},
    "node.packet_energy": _of("node", "currents durations"),
    "node.trace": _of("node", "currents durations"),
    "excitation.acceleration_file": {"excitation.acceleration_psd"},
    "excitation.acceleration_psd_file": {"excitation.acceleration_psd"},
    "excitation.profile": {"excitation.acceleration_psd"},
}
# further lines of the key's own table, for which another value than the example's is needed
SHOCK = ['profile = "half-sine-shock"', 'acceleration_amplitude = "5 g"']
BOARD = ['netlist = "board.cir"', 'terminals = ["/PZ_P", "/PZ_N"]']
LINES = {
    "excitation.pulse_duration": SHOCK,
    "excitation.event_rate": [*SHOCK, 'pulse_duration = "11 ms"'],
    "excitation.harmonics": ['profile = "machine"', 'frequency = "1350 rpm"'],
    "load.terminals": BOARD[:1],
    "load.resistor": BOARD,
    "load.store": BOARD,
    "load.supplies": BOARD,
}
FILES = {
    "shake.csv": "time (s),x (g)\n" + "".join(f"{0.01 * k:.2f},{k % 7 - 3}\n" for k in range(500)),
    "psd.csv": "f (Hz),psd (g^2/Hz)\n1,0.01\n10,0.02\n",
    "packet.csv": "time (s),current (mA)\n0,1\n0.001,4\n0.002,1\n",
    "chip.csv": "voltage (V),current (uA),efficiency\n1,10,0.6\n1,100,0.8\n4,10,0.7\n4,100,0.9\n",
    "board.cir": "* a board\nD1 /PZ_P OUT D\nD2 /PZ_N OUT D\nD3 0 /PZ_P D\nD4 0 /PZ_N D\n"
    "C1 OUT 0 1u\nR3 OUT 0 1meg\nRv OUT VCC 10meg\n.model D D(IS=1u)\n.end\n",
}


def _scene(key, printed):
    """The text of the scene: the key with its printed example, and the keys that it needs with theirs."""
    table = key.partition(".")[0]
    some = {key} | OF_TABLE.get(table, set()) | OF_KEY.get(key, set())
    some |= {f"{k.table}.{k.name}" for k in keys() if k.table == table and k.needed}
    if table != "nondimensional":
        some |= DEVICE
    gone = {other for one in some for other in INSTEAD.get(one, set())}
    if key in LINES:
        gone |= {line for line in DEVICE if line.startswith(f"{table}.")}
    lines: dict[str, list[str]] = {table: [*LINES.get(key, [])]}
    for one in sorted(some - gone):
        name = one.partition(".")
        lines.setdefault(name[0], []).append(f"{name[2]} = {(EXAMPLES | {key: printed})[one]}")
    heads = {of: f"[[{of}]]" if of in SEVERAL else f"[{of}]" for of in lines}
    return "".join(f"{heads[of]}\n" + "\n".join(lines[of]) + "\n" for of in lines)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the files that examples name."""
    place = tmp_path_factory.mktemp("files")
    for name, text in FILES.items():
        (place / name).write_text(text)
    return place


@pytest.mark.parametrize("key", EXAMPLES)
def test_an_example_alone(harvester, folder, key):
    """The example is in the list as it is printed for people, and the scene holds it afterwards."""
    table, _, name = key.partition(".")
    # `harvester keys excitation.profile` lists the profiles
    asked = table if key == "excitation.profile" else key
    status, out, error = harvester("keys", asked, "--json")
    assert (status, error) == (0, "")
    [shown] = [line for line in json.loads(out) if line["name"] == name]
    assert f"  {shown['example']}  " in harvester("keys", asked)[1]
    scene = hv.loads(_scene(key, shown["example"]), folder)
    of = scene.tables()[table]
    assert name in (of[0] if isinstance(of, list) else of)
