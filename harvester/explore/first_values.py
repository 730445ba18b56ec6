"""The value of a key of the scene when its effect is switched on for the first time."""

import math

from harvester.explore.texts import normal, written
from harvester.scene.keys import keys
from harvester.scene.modal_parameters import ModalParameters

# Where a key's example in `harvester keys` does not fit.
_BEGIN = {"nondimensional.c1": "-0.05", "nondimensional.c2": "-0.05", "nondimensional.linear": "1"}
_BEGIN |= {
    "nondimensional.mu": "1",
    "nondimensional.drive_frequency": "1",
    "nondimensional.centre_frequency": "1",
}
_BEGIN |= {
    "nondimensional.D12": "0.001",
    "nondimensional.gap": "0.2",
    "nondimensional.opposite_gap": "1",
}
_BEGIN |= {"nondimensional.restitution": "0.96", "nondimensional.opposite_restitution": "0.9"}
_BEGIN |= {"nondimensional.eps1": "1", "nondimensional.eps2": "1", "nondimensional.D11": "0.01"}
_BEGIN |= {
    "nondimensional.D22": "0.01",
    "nondimensional.stop_stiffness": "100",
    "stop.damping": "0.1 N s/m",
}


def first_text(key: str, modal: ModalParameters | None) -> str:
    """The first text of a key; frequencies and times of a physical scene suit the resonance of its device."""
    name = key.partition(".")[2]
    if key in _BEGIN:
        return _BEGIN[key]
    if modal is not None and name in (
        "frequency",
        "centre_frequency",
        "bandwidth",
        "correlation_time",
    ):
        f0 = modal.frequency / (2.0 * math.pi)
        first = {"bandwidth": 0.2 * f0, "correlation_time": 0.1 / f0}.get(name, f0)
        return written(key, float(f"{first:.3g}"))
    example = next(known.example for known in keys() if f"{known.table}.{known.name}" == key)
    return normal(key, example.strip("\"'"))
