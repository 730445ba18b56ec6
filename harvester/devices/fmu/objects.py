"""Objects for other systems of a function that numba has compiled here, emitted by LLVM.

The code of numba is optimised for no processor in particular. All of it but the entry is made
internal and optimised once more, which removes functions for Python alone, and with them
instructions that other processors lack.
"""

import re
from dataclasses import dataclass
from typing import Any

import llvmlite.binding as llvm

from harvester.errors import CannotServeError, SimulationError

# names of its own: old C libraries have symbols such as `advance` and `step`
ENTRY = "harvester_part"
# Functions of the C library
LIBRARY = {
    "acos",
    "acosh",
    "asin",
    "asinh",
    "atan",
    "atan2",
    "atanh",
    "ceil",
    "cos",
    "cosh",
    "erf",
    "erfc",
    "exp",
    "expm1",
    "floor",
    "fmax",
    "fmin",
    "fmod",
    "hypot",
    "log",
    "log10",
    "log1p",
    "memcpy",
    "memset",
    "pow",
    "sin",
    "sinh",
    "sqrt",
    "tan",
    "tanh",
}
# Arrays here are plain memory: the count of references never ends, and nothing is left to free.
COUNTED_DOWN = re.compile(
    r"(?:tail |notail )?call i8 @llvm\.x86\.atomic\.sub\.cc\.i64\([^)]*\)[^\n]*"
)
FREED = re.compile(r"^[^\n]*call void @NRT_MemInfo_call_dtor\([^\n]*$", re.MULTILINE)
# An array above 1 MB, which numba leaves at its address in this process
BY_ADDRESS = re.compile(r"\binttoptr \(i64 \d{7,} ")
OTHER_PROCESSOR = "llvm.x86."  # operations of one processor alone: LLVM ends the process on another
binding: Any = llvm


class OutsideCodeError(SimulationError):
    """Code that needs functions outside the C library, with their names."""

    names: list[str]


@dataclass(frozen=True)
class Platform:
    """A system: its name, LLVM's triple, zig's target, and the folders of FMI 2 and 3."""

    name: str
    triple: str
    target: str
    ending: str
    folders: tuple[str, str]

    @property
    def has_libm(self) -> bool:
        """Whether mathematical functions have a library of their own."""
        return self.ending == "so"


PLATFORMS = {
    platform.name: platform
    for platform in (
        Platform(
            name="linux-x86_64",
            triple="x86_64-unknown-linux-gnu",
            target="x86_64-linux-gnu.2.17",
            ending="so",
            folders=("linux64", "x86_64-linux"),
        ),
        Platform(
            name="linux-aarch64",
            triple="aarch64-unknown-linux-gnu",
            target="aarch64-linux-gnu.2.17",
            ending="so",
            folders=("aarch64-linux", "aarch64-linux"),
        ),
        Platform(
            name="windows-x86_64",
            triple="x86_64-w64-windows-gnu",
            target="x86_64-windows-gnu",
            ending="dll",
            folders=("win64", "x86_64-windows"),
        ),
        Platform(
            name="macos-aarch64",
            triple="arm64-apple-darwin",
            target="aarch64-macos",
            ending="dylib",
            folders=("darwin64", "aarch64-darwin"),
        ),
    )
}
SYSTEMS = {"linux": "linux", "windows": "windows", "darwin": "macos"}


def host() -> str | None:
    """The platform of this machine, by LLVM's triple; None for one that is not in `PLATFORMS`."""
    triple = str(binding.get_default_triple())
    processor = triple.partition("-")[0].replace("arm64", "aarch64")
    for word, system in SYSTEMS.items():
        if word in triple and f"{system}-{processor}" in PLATFORMS:
            return f"{system}-{processor}"
    return None


def emitted(code: str, platform: Platform, name: str = ENTRY) -> bytes:
    """The object file of LLVM code whose C function gets a ``name``.

    Raises SimulationError for code that needs a function outside the C library, CannotServeError
    for a large array.
    """
    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    machine = binding.Target.from_triple(platform.triple).create_target_machine(
        opt=3, reloc="pic", codemodel="default"
    )
    code = re.sub(r'target (triple|datalayout) = "[^"]*"', "", code)
    module = binding.parse_assembly(FREED.sub("", COUNTED_DOWN.sub("add i8 0, 0", code)))
    module.triple = platform.triple
    module.data_layout = str(machine.target_data)
    entries = [function.name for function in module.functions if function.name.startswith("cfunc.")]
    for function in module.functions:
        if not function.is_declaration and function.name not in entries:
            function.linkage = "internal"
    for variable in module.global_variables:
        if not variable.is_declaration:
            variable.linkage = "internal"
    (entry,) = entries
    module.get_function(entry).name = name
    module.get_function(name).visibility = "hidden"
    builder = binding.create_pass_builder(
        machine, binding.create_pipeline_tuning_options(speed_level=3)
    )
    builder.getModulePassManager().run(module, builder)
    _check_outside(module)
    return bytes(machine.emit_object(module))


def _check_outside(module: Any) -> None:
    """Raise the errors of `emitted` for optimised code."""
    if BY_ADDRESS.search(str(module)):
        raise CannotServeError(
            "an FMU has arrays of at most 1 MB inside, but one of these is larger: shorten it"
        )
    outside = {function.name for function in module.functions if function.is_declaration}
    known = {name for name in outside if name.startswith("llvm.")} | LIBRARY
    if unknown := {name for name in outside if name.startswith(OTHER_PROCESSOR)} | outside - known:
        names = sorted(unknown)
        error = OutsideCodeError(
            "the compiled part must be free of Python and of one processor's operations, but needs "
            f"{', '.join(names)}"
        )
        error.names = names
        raise error
