"""What every study writes beside its numbers: where they come from."""

from typing import Any

from harvester.equations.problem import Problem
from harvester.machine.provenance import origin
from harvester.scene.scene import Scene


def provenance(scene: Scene | Problem, **what: Any) -> dict[str, Any]:
    """All of it, with ``what`` the command asked for."""
    problem = Problem.of(scene)
    circuit = None if problem.netlist is None else problem.circuit
    return origin() | {
        "scene": problem.scene.tables(),
        "scene_digest": problem.scene.digest,
        "netlist": None if circuit is None else circuit.text,
        **what,
    }
