"""Circuit-level co-simulation of vibro-impact piezoelectric energy harvesters.

    import harvester as hv
    scene = hv.load("examples/plate_with_stop.toml")
    print(hv.Averaged().run(scene))
    print(hv.Ensemble(within="1%").run(scene))

The public names are in ``__init__.pyi``, once each; what a name needs is loaded when the name is
first used.
"""

# nothing else before the lines below: a stranger's typing.py in the current folder would be taken
import sys

if (
    sys.argv[:1] == ["-m"]
    and sys.orig_argv[-len(sys.argv)].endswith("harvester")
    and not sys.flags.safe_path
):
    # the current folder, put there for -m: a stranger's random.py in it would be taken for Python's
    del sys.path[0]

from typing import Any

import lazy_loader

_attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__version__ = "0.1.0"

_RENAMED = {  # names of version 0.1, which go with version 0.3
    "Table": "SweepTable",
    "Identified": "IdentificationResult",
    "Charging": "ChargingResult",
    "Response": "FrequencyResponse",
    "Responses": "FrequencyResponses",
    "Front": "ParetoFront",
    "Tolerance": "ToleranceResult",
    "optimise_circuits": "optimise",
    "optimise_robust": "optimise",
    "pareto": "optimise",
}


def __getattr__(name: str) -> Any:
    if name not in _RENAMED:
        return _attribute(name)
    import importlib
    import warnings

    new = _RENAMED[name]
    warnings.warn(
        f"harvester.{name} is harvester.{new} from version 0.3 on", DeprecationWarning, stacklevel=2
    )
    return getattr(
        importlib.import_module("harvester.studies.old_names"), name, None
    ) or _attribute(new)
