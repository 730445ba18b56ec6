"""A scene's device as a file for other simulators: a subcircuit, or an FMU."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Unpack

from harvester.cosimulation.model_protocol import NEEDED
from harvester.devices.fmu.models.model_options import ModelOptions
from harvester.engines.protocol import AnyScene
from harvester.errors import CannotServeError, InputError, names_arguments

OF_MODEL = "a model of `cosimulate`"


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
    **options: Unpack[ModelOptions],
) -> Path:
    """Write a device as a part: an FMU to a file ``.fmu``, else a subcircuit.

    A model of `cosimulate` in place of a scene is an FMU: its functions are compiled as there.

    Parameters
    ----------
    scene : Scene, path or model
        a Scene of a device, the path of its file, or a model of `cosimulate`.
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
    options
        of a model alone, with the meanings of `cosimulate`: ``port``, ``start`` and
        ``step``; ``load``, its circuit (a netlist of elements that engine "compiled" has; with a
        Coil a resistance alone), None for an electrical port with a current (A) as an input; and
        ``inputs``, the names of the model's numbers that are inputs, such as ("a",); the
        others are tunable parameters.

    Returns
    -------
    Path
        that of the file.

    Raises
    ------
    InputError
        for a nondimensional scene, an option of the other kind of part, a file that cannot be
        written, and a model that numba does not compile, or whose functions raise errors.
    CannotServeError
        for an effect that a part lacks, such as noise on the stiffness in a subcircuit, or several
        modes in an FMU; and for a model as a subcircuit.
    MissingProgramError
        for an FMU without the package ziglang.

    Examples
    --------
    >>> import harvester as hv
    >>> mass = hv.Oscillator(mass="40 g", stiffness="16 N/m")
    >>> piezo = hv.Piezo(coupling="1 mN/V", capacitance="50 nF")
    >>> hv.export(hv.Scene(oscillator=mass, piezo=piezo), "/proc/plate.lib")
    Traceback (most recent call last):
    harvester.errors.InputError: `out` must accept plate.lib, but writing failed: ...
    """
    is_fmu = str(out).endswith(".fmu")
    if any(callable(getattr(scene, name, None)) for name in NEEDED):
        of_scene = {"name": name, "duration": duration, "circuit": circuit, "seed": seed or None}
        _check_model_part(out, of_scene)
        from harvester.devices.fmu.models.model_unit import export_model

        export_model(scene, out, options, fmi=2 if fmi is None else fmi, platforms=platforms)
        return Path(out)
    _check_absent(options, f"belong to {OF_MODEL}, but a Scene is given")
    of_subcircuit = {"name": name, "duration": duration}
    of_fmu = {"circuit": circuit, "fmi": fmi, "platforms": platforms}
    others = of_subcircuit if is_fmu else of_fmu
    kind = "a subcircuit" if is_fmu else "an FMU"
    _check_absent(others, f"belong to {kind}, but {str(out)!r} is not one")
    used = of_fmu if is_fmu else of_subcircuit
    given: dict[str, Any] = {key: value for key, value in used.items() if value is not None}
    if is_fmu:
        from harvester.devices.fmu.unit import export_fmu

        export_fmu(scene, out, seed=seed, **given)
    else:
        from harvester.devices.export import export as export_subcircuit

        export_subcircuit(scene, out, seed=seed, **given)
    return Path(out)


def _check_model_part(out: str | Path, of_scene: dict[str, Any]) -> None:
    """Refuse a model as a subcircuit, and options of a scene."""
    if not str(out).endswith(".fmu"):
        raise CannotServeError(
            f"{OF_MODEL} must be an FMU, such as model.fmu, for a subcircuit is of a Scene, but "
            f"`out` is {str(out)!r}"
        )
    _check_absent(of_scene, f"belong to a Scene, but {OF_MODEL} is given")


def _check_absent(options: Mapping[str, Any], requirement: str) -> None:
    """Refuse an option that is given."""
    for option, value in options.items():
        if value is not None:
            raise InputError(f"`{option}` must {requirement}")
