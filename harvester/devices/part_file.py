"""A scene's device as a file for other simulators: a subcircuit, or an FMU."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from harvester.cosimulation.model_protocol import NEEDED
from harvester.engines.protocol import AnyScene
from harvester.errors import CannotServeError, InputError, names_arguments


@names_arguments
def export(
    scene: AnyScene,
    out: str | Path,
    *,
    name: str | None = None,
    duration: str | float | None = None,
    circuit: str | None = None,
    fmi: int | None = None,
    platforms: str | Sequence[str] | None = None,
    seed: int = 0,
) -> Path:
    """Write a scene's device as a part: an FMU to a file ``.fmu``, else a subcircuit.

    Parameters
    ----------
    scene : Scene or path
        a Scene of a device, or the path of its file.
    out : path
        the file: ``device.fmu`` for simulators that import FMI; ``device.lib`` for ngspice, LTspice
        and KiCad.
    name : str, optional
        option of a subcircuit: its name; None: the file's.
    duration : float or str, optional
        option of a subcircuit: the length (s) of noise that is written point by point; None: 1000
        periods.
    circuit : str, optional
        option of an FMU: "inside" (None), with the load, a resistor, an ideal circuit or a compiled
        netlist; "netlist", the same with the netlist itself in place of its ideal circuit; or
        "outside", with an electrical port: current (A) and load resistance (ohm) in, voltage (V)
        out.
    fmi : int, optional
        option of an FMU: 2 (None) for FMI 2.0, or 3 for FMI 3.0 with event mode.
    platforms : str or list of str, optional
        option of an FMU: some of "linux-x86_64", "linux-aarch64", "windows-x86_64" and
        "macos-aarch64", or "all"; None: this machine's.
    seed : int, default 0
        draws noise that is written into the part.

    Returns
    -------
    Path
        that of the file.

    Raises
    ------
    InputError
        for a nondimensional scene, an option of the other kind of part, and a file that cannot be
        written.
    CannotServeError
        for an effect that a part lacks, such as noise on the stiffness in a subcircuit, or several
        modes in an FMU; and for a model of `cosimulate` in place of a scene.
    MissingProgramError
        for an FMU without the package ziglang.

    Examples
    --------
    >>> import harvester as hv
    >>> mass = hv.Oscillator(mass="40 g", stiffness="16 N/m")
    >>> piezo = hv.Piezo(coupling="1 mN/V", capacitance="50 nF")
    >>> hv.export(hv.Scene(oscillator=mass, piezo=piezo), "/nowhere/plate.lib")
    Traceback (most recent call last):
    harvester.errors.InputError: `out` must take plate.lib, but writing failed: ...
    """
    if all(callable(getattr(scene, name, None)) for name in NEEDED):
        raise CannotServeError(
            "a part must be a Scene, for a model of `cosimulate` has no list of its numbers and "
            "units: simulate it with `cosimulate`"
        )
    is_fmu = str(out).endswith(".fmu")
    of_subcircuit = {"name": name, "duration": duration}
    of_fmu = {"circuit": circuit, "fmi": fmi, "platforms": platforms}
    others = of_subcircuit if is_fmu else of_fmu
    kind = "a subcircuit" if is_fmu else "an FMU"
    for option, value in others.items():
        if value is not None:
            raise InputError(f"`{option}` must belong to {kind}, but {str(out)!r} is not one")
    options = of_fmu if is_fmu else of_subcircuit
    given: dict[str, Any] = {key: value for key, value in options.items() if value is not None}
    if is_fmu:
        from harvester.devices.fmu.unit import export_fmu

        export_fmu(scene, out, seed=seed, **given)
    else:
        from harvester.devices.export import export as export_subcircuit

        export_subcircuit(scene, out, seed=seed, **given)
    return Path(out)
