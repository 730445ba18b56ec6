"""A flat board of a user's own with four diodes and a store, on the measured bimorph under noise, with a node."""

import dataclasses
import functools
import tempfile
from pathlib import Path

import harvester as hv

_BOARD = """.title a board of four diodes
D1 /PA /VS DX
D2 /PB /VS DX
D3 GND /PA {other}
D4 GND /PB {other}
C1 /VS GND 100u
R1 /VS GND 10Meg
.model DX D(Is=1u N=1.05 Rs=2 Cjo=20p Bv=40)
.model DY D(Is=20n N=1.3 Rs=5 Cjo=50p Bv=40)
.end
"""


@functools.cache
def own_board(unlike=False):
    """Its load; two of the diodes are ``unlike`` the others."""
    path = Path(tempfile.mkdtemp()) / "board.cir"
    path.write_text(_BOARD.format(other="DY" if unlike else "DX"))
    return hv.Load(netlist=str(path), terminals=("/PA", "/PB"), resistor="R1", store="C1")


def noisy_node(unlike=False, node=None, excitation=None, load=None, stop=None):
    """The board with a store of 100 uF and a node that sends 18 ms of 5 mA every 5 s, from 3 V to 2 V."""
    packet = {"currents": (5e-3,), "durations": (0.018,)}
    given = {
        "wake_voltage": 3.0,
        "stop_voltage": 2.0,
        "interval": 5.0,
        "sleep_current": 1e-6,
        **packet,
    }
    return hv.Scene(
        oscillator=hv.Oscillator(mass="16.542 g", stiffness=1364.1, damping_ratio=0.027),
        piezo=hv.Piezo(coupling=2.5261e-3, capacitance="41.259 nF"),
        excitation=excitation or hv.Excitation(acceleration_psd="0.0005 g^2/Hz"),
        load=load or own_board(unlike),
        storage=hv.Storage(capacitance=1e-4),
        node=hv.SensorNode(**given | (node or {})),
        **({} if stop is None else {"stop": stop}),
    )


def without_node(scene):
    """The same device with its netlist alone."""
    return dataclasses.replace(scene, storage=None, node=None)
