"""Libraries of other systems have the right processor, all functions of FMI, and the system's libraries alone.

They are not run here.
"""

import json
import re
import subprocess
import sys
import zipfile

import pytest

from harvester.devices.fmu.objects import PLATFORMS
from harvester.devices.fmu.unit import export_fmu
from tests.support import fmu
from tests.support.paths import EXAMPLES

pytest.importorskip("fmpy")
pytest.importorskip("ziglang")
pytestmark = pytest.mark.slow

# By the ending of the file: magic number; if the processor is named, and how; libraries that may be needed
FORMATS = {
    ("so", "x86_64"): (b"\x7fELF", 18, b"\x3e\x00", {b"libc.so.6", b"libm.so.6"}),
    ("so", "aarch64"): (b"\x7fELF", 18, b"\xb7\x00", {b"libc.so.6", b"libm.so.6"}),
    ("dylib", "aarch64"): (b"\xcf\xfa\xed\xfe", 4, b"\x0c\x00\x00\x01", {b"libSystem.B.dylib"}),
    ("dll", "x86_64"): (b"MZ", None, b"PE\x00\x00\x64\x86", {b"KERNEL32.dll"}),
}
COSIM = """
import json, sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave
log_output_level(CosimLogLevel.ERROR)
run = CosimExecution.from_step_size(step_size=1e7)
index = run.add_local_slave(local_slave=CosimLocalSlave(fmu_path=sys.argv[1], instance_name="device"))
observer = CosimObserver.create_last_value()
run.add_observer(observer=observer)
assert run.simulate_until(target_time=2_000_000_000)
number = {one.name.decode(): one.reference for one in run.slave_variables(slave_index=index)}
names = "displacement", "voltage", "impact_time"
print(json.dumps(list(observer.last_real_values(slave_index=index, variable_references=[number[n] for n in names]))))
"""
FMPY = """
r = simulate_fmu(fmu, stop_time=2.0, step_size=0.01, output_interval=0.01)[-1]
print(json.dumps([float(r[name]) for name in ("displacement", "voltage", "impact_time")]))
"""


@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    """The library of each platform, and how many bytes the FMU of all has."""
    path = tmp_path_factory.mktemp("all") / "plate.fmu"
    made = export_fmu(EXAMPLES / "plate_with_stop.toml", path, platforms="all")
    assert made.platforms == list(PLATFORMS)
    with zipfile.ZipFile(path) as archive:
        inside = {
            name: archive.read(f"binaries/{one.folders[0]}/plate.{one.ending}")
            for name, one in PLATFORMS.items()
        }
    return inside, made.size


def functions(library):
    """The names of FMI's functions in a library."""
    return set(re.findall(rb"(?<=[\0_])fmi2[A-Z]\w+(?=\0)", library))


@pytest.mark.parametrize("name", PLATFORMS)
def test_a_library_of_another_system(libraries, name):
    library = libraries[0][name]
    platform = PLATFORMS[name]
    magic, place, processor, system = FORMATS[platform.ending, name.rpartition("-")[2]]
    assert library.startswith(magic)
    assert library[place:].startswith(processor) if place is not None else processor in library
    assert functions(library) == functions(libraries[0]["linux-x86_64"])
    assert len(functions(library)) == 34  # those of FMI 2.0 for co-simulation
    needed = set(re.findall(rb"[\w.-]+\.(?:so\.\d+|B\.dylib|dll)(?=\0)", library, re.IGNORECASE))
    own = f"part.{platform.ending}".encode()
    assert {
        one for one in needed - system - {own} if not one.lower().startswith(b"api-ms-win-crt-")
    } <= {b"ld-linux-x86-64.so.2", b"ld-linux-aarch64.so.1", b"libpthread.so.0", b"libdl.so.2"}
    assert b"PyErr" not in library
    assert b"numba_gil" not in library


def test_size(libraries):
    """All four systems in one file of at most 200 kB."""
    assert libraries[1] < 200e3


def test_another_importer():
    """libcosim, if its package is there, has the numbers of FMPy."""
    pytest.importorskip("libcosimpy")
    path = fmu.built()
    done = subprocess.run(
        [sys.executable, "-c", COSIM, str(path)],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        cwd=path.parent,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout.splitlines()[-1])
    assert found == pytest.approx(fmu.run(path, FMPY), rel=1e-10)
