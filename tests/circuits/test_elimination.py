"""Elimination as straight lines solves what numpy solves, and states where its pivots fail."""

import numpy as np
import pytest

import harvester as hv
from harvester.circuits.elimination import lines_of, pivots
from harvester.circuits.newton_parts import LARGEST
from harvester.equations.problem import Problem
from tests.support.netlists import BRIDGE, STORE, compiled, on_plate


def solved(matrix, right, order, pattern):
    """The solution by the lines, and whether they call it safe."""
    n = len(right)
    names = {f"a{i}_{j}": float(matrix[i, j]) for i in range(n) for j in range(n) if pattern[i, j]}
    names |= {f"b{i}": float(right[i]) for i in range(n)}
    exec("\n".join(lines_of(order, pattern, [["1e9"] * n] * n)), names)
    return np.array([names[f"z{k}"] for k in range(n)]), names["safe"]


@pytest.mark.parametrize("seed", range(20))
def test_random_matrices(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 15))
    pattern = (rng.random((n, n)) < 0.3) | np.eye(n, dtype=bool)[rng.permutation(n)]
    samples = rng.normal(size=(8, n, n)) * pattern
    order = pivots(samples, pattern)
    assert (
        sorted(row for row, _ in order) == sorted(column for _, column in order) == list(range(n))
    )
    matrix = rng.normal(size=(n, n)) * pattern
    right = rng.normal(size=n)
    found, safe = solved(matrix, right, order, pattern)
    assert safe
    assert matrix @ found == pytest.approx(right, rel=1e-6, abs=1e-6 * np.abs(right).max())


def test_a_place_that_may_be_zero_is_no_pivot():
    """Such as the derivative of a source that is cut off; if it comes first all the same, the lines state so."""
    pattern = np.array([[True, True], [True, True]])
    samples = np.array([[[1.0, 1.0], [1.0, 2.0]], [[0.0, 1.0], [1.0, 0.0]]])
    order = pivots(samples, pattern)
    assert {(0, 1), (1, 0)} == set(order)
    found, safe = solved(
        np.array([[1e-12, 1.0], [1.0, 0.0]]), np.array([1.0, 2.0]), [(0, 0), (1, 1)], pattern
    )
    assert not safe or not np.isfinite(found).all()
    assert solved(samples[1], np.array([1.0, 2.0]), order, pattern)[0] == pytest.approx([2.0, 1.0])


@pytest.mark.slow
def test_pivots_of_the_matrix_at_hand_take_over(monkeypatch):
    """A circuit whose lines are never called safe moves as the one whose lines always are."""
    scene = hv.load("examples/plate_harmonic.toml").with_load(
        netlist="bridge", parameters={"R": 1e6, "C": 1e-7}
    )
    equations = Problem.of(scene).equations

    def square():
        return compiled(scene).trace(equations, np.zeros(400), 0.1, 400).square[-1]

    expected = square()
    monkeypatch.setattr("harvester.circuits.newton.LARGEST", 0.0)
    assert square() == pytest.approx(expected, rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("furthest", [LARGEST, 0.0])
def test_a_tape_of_numbers_solves_as_the_lines(tmp_path, monkeypatch, furthest):
    """Also with the pivots of the matrix at hand, and with a Zener diode, an inductor and a voltage source."""
    (tmp_path / "a.cir").write_text(
        "t\nD1 A O DP\nD2 B O DP\nD3 0 A DP\nD4 0 B DP\nDz 0 O DZ\nL1 O P 10 ic=0\n"
        "V1 P R 0.1\nCs R 0 100n\nRL R 0 250k\n.model DP D(Is=2u N=1.06 Rs=4 Cjo=40p Tt=1u)\n"
        ".model DZ D(Bv=3)\n"
    )
    path = str(tmp_path / "a.cir")
    load = hv.Load(netlist=path, terminals=("A", "B"), resistor="RL", store="Cs")
    scene = hv.load("examples/plate_harmonic.toml").with_load(load)
    equations = Problem.of(scene).equations

    def followed():
        circuit = compiled(scene)
        path = circuit.trace(equations, np.zeros(400), 0.1, 400)
        return len(circuit.solver.text), path.failed, path.square[-1], path.state

    lines, _, square, state = followed()
    monkeypatch.setattr("harvester.circuits.newton.LARGEST", furthest)
    monkeypatch.setattr("harvester.circuits.newton.MOST_WRITTEN", 0)
    tape, failed, again, other = followed()
    assert (failed, tape < lines) == (0, True)
    assert square > 0.0
    assert again == pytest.approx(square, rel=1e-6)
    assert other == pytest.approx(state, rel=1e-6, abs=1e-6 * np.abs(state).max())


@pytest.mark.slow
def test_ladders_of_many_diodes_have_one_source(tmp_path):
    """Sixty diodes were compiled for a minute before any budget was looked at."""

    def ladder(count):
        stages = "".join(f"R{k} n{k} m{k} 100\nD{k} m{k} n{k + 1} DX\n" for k in range(count))
        (tmp_path / "a.cir").write_text(
            f"t\n{stages}Cs n{count} 0 1u\nRL n{count} 0 100k\nDb 0 n0 DX\n.model DX D(Is=1n Rs=1)\n"
        )
        load = hv.Load(netlist=str(tmp_path / "a.cir"), terminals=("n0", "0"), resistor="RL")
        scene = hv.load("examples/plate_harmonic.toml").with_load(load)
        circuit = compiled(scene)
        assert len(circuit.system.diodes) == count + 1
        path = circuit.trace(Problem.of(scene).equations, np.zeros(400), 0.1, 400)
        assert path.failed == 0
        return circuit.solver, path.square[-1]

    (few, shorter), (many, longer) = ladder(30), ladder(60)
    assert few.text == many.text
    assert len(many.arguments) < 3 * len(few.arguments)
    assert shorter > longer > 0.0


@pytest.mark.ngspice
@pytest.mark.parametrize("engine", [hv.Compiled, hv.Spice])
def test_equations_without_one_solution_are_refused(tmp_path, engine):
    """Two inductors side by side that are coupled perfectly: how the current divides is open (a KeyError before)."""
    body = BRIDGE.format("BAT54") + STORE + "L1 p n 1\nL2 p n 1\nK1 L1 L2 1"
    with pytest.raises(hv.CannotServeError, match="has no single solution: give inductors"):
        engine(trajectories=2, duration=1.0).run(on_plate(tmp_path, body))
