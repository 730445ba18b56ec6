"""A scene's device as a file for other simulators: a subcircuit, or a functional mock-up unit (FMU)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from harvester.engines.protocol import AnyScene
from harvester.errors import InputError

OF_SUBCIRCUIT, OF_FMU = ("name", "duration"), ("circuit", "fmi", "platforms")


def export(
    scene: AnyScene,
    out: str | Path,
    *,
    name: str | None = None,
    duration: str | float | None = None,
    circuit: str | None = None,
    fmi: int | None = None,
    platforms: Sequence[str] | None = None,
    seed: int = 0,
) -> None:
    """Write a scene's device as a part for other simulators: an FMU to a file ``.fmu``, else a subcircuit.

    >>> import harvester as hv
    >>> plate = hv.Oscillator(mass="40 g", stiffness="16 N/m"), hv.Piezo(coupling="1 mN/V", capacitance="50 nF")
    >>> hv.export(hv.Scene(oscillator=plate[0], piezo=plate[1]), "/nowhere/plate.lib")
    Traceback (most recent call last):
    harvester.errors.InputError: `out` must take plate.lib, but writing failed: ...

    Parameters
    ----------
    scene
        a Scene of a device, or the path of its file.
    out
        the file: ``device.fmu`` for simulators that import FMI; ``device.lib`` for ngspice, LTspice and KiCad.
    name, duration
        of a subcircuit: its name (None: the file's), and the length (s) of noise that is written point by point (None:
        1000 periods).
    circuit
        of an FMU: "inside" (None), with the load, a resistor or an ideal circuit; or "outside", with an electrical
        port: current (A) and load resistance (ohm) in, voltage (V) out.
    fmi
        of an FMU: 2 (None) for FMI 2.0, or 3 for FMI 3.0 with event mode.
    platforms
        of an FMU: some of "linux-x86_64", "linux-aarch64", "windows-x86_64" and "macos-aarch64"; None: all.
    seed
        draws noise that is written into the part.

    Raises
    ------
    InputError
        for a nondimensional scene, an option of the other kind of part, and a file that cannot be written.
    CannotServeError
        for what a part does not know, such as noise on the stiffness in a subcircuit, or further modes in an FMU.
    MissingProgramError
        for an FMU without the package ziglang.
    """
    options = {
        "name": name,
        "duration": duration,
        "circuit": circuit,
        "fmi": fmi,
        "platforms": platforms,
    }
    given: dict[str, Any] = {key: value for key, value in options.items() if value is not None}
    export_part(scene, out, seed=seed, is_fmu=str(out).endswith(".fmu"), **given)


def export_part(
    scene: AnyScene,
    out: str | Path,
    *,
    seed: int,
    is_fmu: bool,
    argument: str = "out",
    **options: Any,
) -> str:
    """Write a part, as `export`; returns a line that says how it is used."""
    others, kind = (OF_SUBCIRCUIT, "a subcircuit") if is_fmu else (OF_FMU, "an FMU")
    for other in others:
        if other in options:
            raise InputError(f"`{other}` must go with {kind}, but {str(out)!r} is not one")
    if is_fmu:
        from harvester.devices.fmu.unit import export_fmu

        made = export_fmu(scene, out, seed=seed, argument=argument, **options)
        platforms = ", ".join(made.platforms)
        return (
            f"FMU {made.name}: {len(made.variables)} variables, inner step {made.step:.3g} s, "
            f"{made.size / 1e3:.0f} kB for {platforms}"
        )
    from harvester.devices.export import export as write

    name = write(scene, out, seed=seed, **options)
    return f"subcircuit {name}: the first lines of the file say how it is used"
