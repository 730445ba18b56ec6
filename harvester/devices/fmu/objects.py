"""Objects for other systems of a function that numba has compiled here: LLVM's own code, emitted for each target.

The code that numba hands out is optimised for no processor in particular. All of it but the entry is made internal and
optimised once more: what only Python would use goes with that, and with it what other processors do not have.
"""

import re
from dataclasses import dataclass
from typing import Any

import llvmlite.binding as llvm

from harvester.errors import SimulationError

ENTRY = (
    "harvester_part"  # a name of its own: old C libraries have symbols such as `advance` and `step`
)
# What the C library gives
LIBRARY = {
    "acos",
    "atan2",
    "ceil",
    "cos",
    "exp",
    "expm1",
    "floor",
    "fmax",
    "fmin",
    "fmod",
    "log",
    "log1p",
    "memcpy",
    "memset",
    "pow",
    "sin",
    "sqrt",
}
binding: Any = llvm


@dataclass(frozen=True)
class Platform:
    """A system: the name that users give, LLVM's triple, zig's target, and the folders of FMI 2 and 3."""

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
            "linux-x86_64",
            "x86_64-unknown-linux-gnu",
            "x86_64-linux-gnu.2.17",
            "so",
            ("linux64", "x86_64-linux"),
        ),
        Platform(
            "linux-aarch64",
            "aarch64-unknown-linux-gnu",
            "aarch64-linux-gnu.2.17",
            "so",
            ("aarch64-linux", "aarch64-linux"),
        ),
        Platform(
            "windows-x86_64",
            "x86_64-w64-windows-gnu",
            "x86_64-windows-gnu",
            "dll",
            ("win64", "x86_64-windows"),
        ),
        Platform(
            "macos-aarch64",
            "arm64-apple-darwin",
            "aarch64-macos",
            "dylib",
            ("darwin64", "aarch64-darwin"),
        ),
    )
}


def emitted(code: str, platform: Platform) -> bytes:
    """The object file of LLVM code whose C function becomes `ENTRY`.

    Raises SimulationError for code that needs what is not in the C library.
    """
    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    machine = binding.Target.from_triple(platform.triple).create_target_machine(
        opt=3, reloc="pic", codemodel="default"
    )
    module = binding.parse_assembly(re.sub(r'target (triple|datalayout) = "[^"]*"', "", code))
    module.triple, module.data_layout = platform.triple, str(machine.target_data)
    entries = [function.name for function in module.functions if function.name.startswith("cfunc.")]
    for function in module.functions:
        if not function.is_declaration and function.name not in entries:
            function.linkage = "internal"
    for variable in module.global_variables:
        if not variable.is_declaration:
            variable.linkage = "internal"
    (entry,) = entries
    module.get_function(entry).name = ENTRY
    module.get_function(ENTRY).visibility = "hidden"
    builder = binding.create_pass_builder(
        machine, binding.create_pipeline_tuning_options(speed_level=3)
    )
    builder.getModulePassManager().run(module, builder)
    outside = {function.name for function in module.functions if function.is_declaration}
    unknown = {name for name in outside if not name.startswith("llvm.")} - LIBRARY
    if unknown:
        raise SimulationError(
            f"the compiled part must be free of Python, but needs {', '.join(sorted(unknown))}"
        )
    return bytes(machine.emit_object(module))
