"""The mechanics: the step of the coupled equations, compiled, for many trajectories or one path."""

import sys

from harvester.machine.imports import load_elsewhere

if load_elsewhere("numba"):
    vars(sys.modules["numba.core.config"])["_config_fname"] = ""  # .numba_config.yaml, looked for at each compilation
