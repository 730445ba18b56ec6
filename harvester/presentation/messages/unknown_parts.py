"""Short names for the parts of an error that are not known: the content of `harvester.uncertainty.value.Value.unknown`.

They follow "the error of".
"""

STEP = "the time step"
SHUNT = "the capacitance from each node to ground"
TOLERANCE = "ngspice's tolerance"
STEP_AND_TOLERANCE = f"{STEP} and {TOLERANCE}"
IDEAL_ELEMENTS = "ideal diodes and switches"
COMPILED_CIRCUIT = "the difference from ngspice"
RARE_MOTIONS = "motions too large and rare for a sample"
WELLS = "the share of each well"
WITHOUT_NGSPICE = "leaving ngspice out"
TIME_SCALES = "separating vibration and circuit"
QUICK_UNDER_NOISE = f"sampling, {STEP}, {COMPILED_CIRCUIT} and {TIME_SCALES}"
CUT_SHORT = "a response that was cut short"
PAPERS_FORMULA = "the paper's formula"
MEASURED_CURRENT = "the sampling of the current near the target"
STORAGE = "storage that is not settled"
OWN_CLOCK = "the circuit's own slow clock"
