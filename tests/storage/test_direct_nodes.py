"""Many nodes directly under noise: what comes into their stores is what they draw, keep and lose to the clamp."""

import dataclasses

import numpy as np
import pytest

import harvester as hv
from harvester.equations.problem import Problem
from harvester.storage.measured_current import measured
from harvester.storage.node_run import NodeRun
from tests.support.direct_nodes import direct_nodes
from tests.support.own_board import noisy_node

C = 1e-4
PACKET = 5e-3 * 0.018


@pytest.mark.slow
def test_energy_is_conserved():
    """Each packet draws its charge; one that is cut off draws what is between the stop voltage and where it began."""
    scene = noisy_node(node={"interval": 0.5, "sleep_current": None}, load=hv.Netlist("bridge"))
    problem = Problem.of(scene)
    run = NodeRun(measured(problem, count=3, runs=64).best, scene.storage, scene.node)
    found = direct_nodes(problem, run, 20.0, 64, seed=3)
    packets = found.packets
    assert packets.min() >= 1 and (found.brown_outs > 0).all() and (found.clamped == 0.0).all()
    kept = 0.5 * C * found.volts**2
    least = packets * PACKET * 2.0
    most = (packets + found.brown_outs + 1.0) * PACKET * 3.1
    assert (found.given - kept > least).all() and (found.given - kept < most).all()
    assert (found.first > 1.0).all() and found.seconds == pytest.approx(20.0, abs=0.1)


@pytest.mark.slow
def test_ideal_diodes_stand_for_the_boards_own():
    """On the same noise the storage capacitors of 64 runs come as far with the netlist's own
    diodes, to 2 % (sampling 0.1 %)."""
    scene = noisy_node(node={"wake_voltage": 9.0})
    problem = Problem.of(scene)
    run = NodeRun(measured(problem, count=3, runs=64).best, scene.storage, scene.node)
    ideal, own = (
        direct_nodes(problem, run, 2.0, 64, compiled=compiled) for compiled in (False, True)
    )
    assert ideal.packets.sum() == own.packets.sum() == 0
    changes = own.volts / ideal.volts - 1.0
    assert abs(changes.mean()) < 0.02 and changes.std(ddof=1) / 8.0 < 2e-3
    assert not np.array_equal(own.volts, ideal.volts)


def test_a_board_of_unlike_diodes_has_ideal_ones_in_the_middle():
    from harvester.storage.rectifier_cut import cut_behind_rectifier

    board = noisy_node(unlike=True)
    cut = cut_behind_rectifier(Problem.of(board).circuit)
    assert cut.diode is None
    assert cut.like == pytest.approx(((1e-6 * 20e-9) ** 0.5, (1.05 * 1.3) ** 0.5))
    assert dataclasses.replace(cut, rectifier=cut.rectifier[:2]).like == pytest.approx((1e-6, 1.05))
