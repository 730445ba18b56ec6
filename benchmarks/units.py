"""Export and speed of FMUs: time of compiling and linking, sizes, and seconds for a simulated second.

The seconds are of the FMU in FMPy, of the package's kernel with the same step (`trace`), and of
ngspice alone with the exported subcircuit.  Each is CPU time, the least of five, of ngspice of three,
in turn in one go.  A located device has no kernel of its own; the kernel's row is then the grid of a fifth
of the default step.

    python benchmarks/units.py
"""

import re
import resource
import subprocess
import tempfile
import time
import zipfile
from pathlib import Path

import numpy as np
from common import report
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from harvester.devices.export import part as subcircuit
from harvester.devices.fmu import fixed_scales, parts
from harvester.devices.fmu.contents.build import _linked as library
from harvester.devices.fmu.contents.header import header
from harvester.devices.fmu.objects import PLATFORMS, host
from harvester.devices.fmu.unit import compiled as code_of
from harvester.devices.fmu.unit import export_fmu
from harvester.devices.fmu.variables import variables
from harvester.equations.problem import Problem
from harvester.mechanics.part import gridded
from harvester.mechanics.trace import trace

EXAMPLES = Path(__file__).parents[1] / "examples"
SCENES = (
    "plate_harmonic_stop.toml",
    "plate_with_stop.toml",
    "plate_compliant_stop.toml",
    "bimorph_board.toml",
)
SECONDS = 20.0
SECONDS_OF_NGSPICE = 2.0
COMMUNICATION = 0.01  # s


def taken(call):
    """The CPU time of a call (s), that of programs that it starts included."""

    def used():
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        return time.process_time() + children.ru_utime + children.ru_stime

    begin = used()
    call()
    return used() - begin


def compiled(scene):
    """Times of compiling, and per platform of linking, with the library's size."""
    problem = Problem.of(EXAMPLES / scene).plain
    part = parts.part_of(problem, problem.scales)
    some = variables(problem, part)
    code = []
    row = {"scene": scene}
    row["LLVM code (s)"] = taken(lambda: code.append(code_of(part)))
    content = header(some, part, "{0}", problem.scales.frequency)
    for platform in PLATFORMS.values():
        made = []
        library(code[0], content, platform, 2)  # builds the system's C library, if it is not there
        row[f"{platform.name} (s)"] = taken(
            lambda platform=platform, made=made: made.append(library(code[0], content, platform, 2))
        )
        row[f"{platform.name} (kB)"] = len(made[0]) / 1e3
    return row


def steps_in_fmpy(fmu, step):
    """A call that simulates in an importer."""
    described = read_model_description(fmu)
    slave = FMU2Slave(
        guid=described.guid,
        unzipDirectory=extract(fmu, unzipdir=tempfile.mkdtemp(dir=fmu.parent)),
        modelIdentifier=described.coSimulation.modelIdentifier,
        instanceName="device",
    )
    slave.instantiate()

    def simulate():
        slave.reset()
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        slave.exitInitializationMode()
        for k in range(round(SECONDS / step)):
            slave.doStep(currentCommunicationPoint=k * step, communicationStepSize=step)

    return simulate


def own_kernel(problem):
    """A call of the package's kernel with the grid's step."""
    eqs = fixed_scales.equations(problem, problem.scales)
    h = parts.step_from_rest(eqs, gridded.STEP)
    steps = round(SECONDS * problem.scales.frequency / h)
    noise = np.random.default_rng(1).standard_normal(steps) * float(eqs.has_new_noise)
    stride = max(1, steps // 2000)
    board = parts.part_of(problem, problem.scales).board
    if board is None:
        return lambda: trace(eqs, noise, h, stride=stride)
    shaking = eqs.drive * np.cos(eqs.drive_frequency * h * np.arange(steps + 1))
    return lambda: board.trace(eqs, noise, h, stride=stride, shaking=shaking)


def ngspice(problem):
    """A call of ngspice with the exported subcircuit and the load, in batch mode."""
    text = subcircuit(problem, "device")
    options = re.search(r"^\*   (\.options .*)$", text, re.MULTILINE)[1]
    if problem.netlist:  # as the exported file advises for circuits that switch
        options = options.replace("reltol=1e-5", "reltol=1e-4")
    longest = re.search(r"^\*   \.tran .*?(\S+)(?: uic)?$", text, re.MULTILINE)[1]
    deck = [
        "bench",
        text,
        "Xbase acc device_base",
        "Xdevice p 0 acc x device",
        problem.circuit.text if problem.netlist else f"Rload p 0 {problem.scene.load.resistance}",
        options,
        ".save v(p)",
        f".tran {longest} {SECONDS_OF_NGSPICE} 0 {longest} uic",
        ".control",
        "run",
        ".endc",
        ".end",
    ]

    def simulate():
        done = subprocess.run(
            ["ngspice", "-b", "/dev/stdin"],
            input="\n".join(deck),
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )
        assert "No. of Data Rows" in done.stdout, done.stdout[-500:] + done.stderr[-500:]

    return simulate


def speeds(scene, folder):
    """Seconds for a simulated second, and ratios to the kernel."""
    problem = Problem.of(EXAMPLES / scene).plain
    fmu = Path(folder) / scene.replace(".toml", ".fmu")
    made = export_fmu(EXAMPLES / scene, fmu, platforms=[host()])
    calls = {
        "FMU, steps of 1 s": (steps_in_fmpy(fmu, 1.0), SECONDS, 5),
        "FMU, steps of 10 ms": (steps_in_fmpy(fmu, COMMUNICATION), SECONDS, 5),
        "kernel": (own_kernel(problem), SECONDS, 5),
        "ngspice": (ngspice(problem), SECONDS_OF_NGSPICE, 3),
    }
    calls["kernel"][0]()  # compiles
    least = dict.fromkeys(calls, np.inf)
    for k in range(5):
        for name, (call, seconds, repeats) in calls.items():
            if k < repeats:
                least[name] = min(least[name], taken(call) / seconds)
    row = {"scene": scene, "FMU (kB)": made.size / 1e3, "inner step (s)": made.step}
    with zipfile.ZipFile(fmu) as archive:
        row["library (kB)"] = max(one.file_size for one in archive.infolist()) / 1e3
    row |= {f"{name} (s per s)": value for name, value in least.items()}
    kernel = least.pop("kernel")
    return row | {f"{name} / kernel": value / kernel for name, value in least.items()}


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        rows = [speeds(scene, folder) for scene in SCENES]
    report("units", [*rows, *map(compiled, SCENES[:2])], ("ziglang", "FMPy"))
