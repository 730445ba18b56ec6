"""`harvester keys`: the examples are values of a device, which a scene accepts as they are."""

import pytest

import harvester as hv
from harvester.scene.keys import keys

DEVICE = """
[oscillator]
{oscillator}
[piezo]
{piezo}
[excitation]
{excitation}
[load]
netlist = "bridge"
parameters = {{ R = "1 Mohm", C = "1 uF" }}
"""
TABLES = {
    "oscillator": ("mass", "stiffness", "damping_ratio"),
    "piezo": ("capacitance", "open_circuit_frequency"),
    "excitation": ("acceleration_amplitude", "frequency"),
    "storage": (
        *("capacitance", "leakage_resistance", "esr", "initial_voltage", "clamp_voltage"),
        *("capacitance_left", "diffusion_capacitance", "diffusion_resistance"),
    ),
    "node": (
        *("wake_voltage", "stop_voltage", "interval", "currents", "durations", "sleep_current"),
        *("stopped_current", "supply_voltage", "efficiency", "lost_share", "retries"),
        *("low_voltages", "low_interval"),
    ),
    "mode": ("frequency", "mass", "damping_ratio", "coupling", "base"),
}


def _lines(table):
    examples = {key.name: key.example for key in keys() if key.table == table}
    return "\n".join(f"{name} = {examples[name]}" for name in TABLES[table])


@pytest.mark.parametrize("more", [("storage", "node"), ("mode",)])
def test_examples_of_tables_together_are_a_scene(more):
    """A node wakes above its stop voltage, sleeps with less than it sends, and an upper mode is above the first."""
    text = DEVICE.format(**{name: _lines(name) for name in ("oscillator", "piezo", "excitation")})
    for table in more:
        head = "[[mode]]" if table == "mode" else f"[{table}]"
        text += f"{head}\n{_lines(table)}\n"
    scene = hv.loads(text)
    if scene.node is not None:
        assert scene.node.sleep_current < 1e-3 * min(scene.node.currents)


def test_examples_of_a_nondimensional_scene():
    """Linear damping is positive, and the noise is one that a run has."""
    examples = {key.name: key.example for key in keys() if key.table == "nondimensional"}
    text = "\n".join(f"{name} = {examples[name]}" for name in ("c1", "beta", "mu", "D11"))
    assert hv.Exact().run(hv.loads("[nondimensional]\n" + text)).mean_power.value > 0.0
