"""Each kind of voltage source of a compiled circuit holds its law along a path, whatever the others do."""

import numpy as np
import pytest

from harvester.equations.problem import Problem
from tests.support.netlists import compiled, on_plate

BODY = """Rload p n 500k
V1 z n 0.7
Rz z n 1Meg
E1 x n p n 2
Rx x n 1Meg
B1 y n V=3*v(p,n)-v(z,n)^2
Ry y n 1Meg
Vm p m 0
Rm m n 1Meg
H1 w n Vm 2k
Rw w n 1Meg"""


@pytest.mark.slow
def test_voltages_of_sources_are_those_of_their_laws(tmp_path):
    """A constant, a multiple of a voltage or a current, and a function: without its law a source floats."""
    scene = on_plate(tmp_path, BODY)
    circuit = compiled(scene)
    noise = np.random.default_rng(0).normal(size=200)
    path = circuit.trace(Problem(scene).equations, noise, 0.05, keep=True)
    y = circuit.unknowns(path.states)
    at = circuit.system.unknowns
    v = {name.removeprefix("xload."): y[:, k] for name, k in at.items()}
    v["n"] = v.get("n", np.zeros(len(y)))
    across = {name: v[name] - v["n"] for name in "pzxymw"}
    size = np.abs(across["p"]).max()
    known = {
        "z": np.full(len(y), 0.7),
        "x": 2.0 * across["p"],
        "y": 3.0 * across["p"] - across["z"] ** 2,
        "m": across["p"],
        "w": 2e3 * across["m"] / 1e6,
    }
    assert size > 0.1
    for name, voltage in known.items():
        assert np.abs(across[name] - voltage).max() < 1e-9 * max(size, 1.0), name
