"""A device without a stop and its load circuit as one netlist for ngspice alone, under a harmonic base.

The mass is a coil, the spring a capacitor, the damping a resistor and the piezo a transformer:
force is voltage and velocity is current.
"""

import re
import subprocess

MESH = """whole device
Vbase b0 0 SIN(0 {force!r} {f!r} 0 0 90)
Lmass b0 b1 {M!r}
Rdamping b1 b2 {c!r}
Cspring b2 b3 {compliance!r}
Etransformer b3 b4 p 0 {theta!r}
Vspeed b4 0 0
Ftransformer 0 p Vspeed {theta!r}
Cp p 0 {Cp!r}
{text}
.options method={method} reltol={reltol!r}
.save @r.xload.rload[p]
.tran {step!r} {end!r} {begin!r} {step!r} uic
.control
run
meas tran power AVG @r.xload.rload[p]
.endc
.end
"""


def mean_power(device, text, periods, reltol, steps, method="gear maxord=2"):
    """Mean power (W) of the load in two periods of the drive, after so many from rest.

    device: M (kg), k (N/m), c (N s/m), theta (N/V), Cp (F), force (N) and f (Hz).  The ``text`` is that of the load
    between p and 0; ``steps`` are those of a period at least.

    Raises SystemExit where ngspice fails.
    """
    period = 1.0 / device["f"]
    given = device | {"compliance": 1.0 / device["k"], "text": text, "reltol": reltol}
    given["method"] = method
    times = {"step": period / steps, "begin": periods * period, "end": (periods + 2) * period}
    deck = MESH.format(**given, **times)
    done = subprocess.run(
        ["ngspice", "-b", "/dev/stdin"], input=deck, capture_output=True, text=True, check=False
    )
    found = re.search(r"power\s+=\s+(\S+)", done.stdout)
    if found is None or "aborted" in done.stdout + done.stderr:
        raise SystemExit(f"ngspice alone failed:\n{(done.stdout + done.stderr)[-600:]}")
    return float(found[1])
