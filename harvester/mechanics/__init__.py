"""The mechanics: the step of the coupled equations, compiled, for many trajectories or one."""

import importlib
import sys

from harvester.machine.imports import load_elsewhere

if load_elsewhere("numba"):
    # .numba_config.yaml, looked for at each compilation
    vars(sys.modules["numba.core.config"])["_config_fname"] = ""
    # To learn whether SciPy has a BLAS, numba would load all of scipy.linalg: 0.2 s.  It has, and
    # no kernel needs it; whatever does loads it when it is compiled.
    linalg = vars(importlib.import_module("numba.np.linalg"))
    if check := linalg.get("ensure_blas"):  # numba's own name, which another version need not have
        linalg["ensure_blas"] = lambda: None
        try:
            importlib.import_module("numba.np.arraymath")
        finally:
            linalg["ensure_blas"] = check
