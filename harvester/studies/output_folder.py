"""What every study writes beside its numbers: where they come from."""

from typing import Any

from harvester.machine.provenance import whence
from harvester.netlists.load_circuit import load_circuit
from harvester.scene.scene import Scene


def provenance(scene: Scene, **what: Any) -> dict[str, Any]:
    """All of it, with ``what`` the command asked for."""
    return whence() | {
        "scene": scene.tables(),
        "scene_digest": scene.digest,
        "netlist": None if scene.load is None or scene.load.netlist is None else load_circuit(scene.load).text,
        **what,
    }
