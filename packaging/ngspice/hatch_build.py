"""What makes `pip wheel packaging/ngspice` build ngspice first: a hook of Hatchling, which makes the wheel."""

import os
import sys
import tempfile
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

sys.path.insert(0, str(Path(__file__).parent))

from recipe import build, source, targets

PACKAGE = "piezo_harvester_ngspice"
# The licences of what is in the library: ngspice's own, which lists those of its parts, and its
# compiler's libraries'.
LICENCES = {
    "libcxx": "lib/libcxx/LICENSE.TXT",
    "libcxxabi": "lib/libcxxabi/LICENSE.TXT",
    "zig": "LICENSE",
}


class Hook(BuildHookInterface):
    """Builds ngspice for the machine of NGSPICE_TARGET, or for this one, and puts it into the wheel."""

    def initialize(self, version, build_data):
        """Build, and tell Hatchling the files and the tag; an editable install is refused, as it has no library."""
        name = os.environ.get(targets.VARIABLE) or targets.this_machine()
        if name not in targets.TARGETS:
            self.app.abort(
                f"{targets.VARIABLE} must be one of {', '.join(targets.TARGETS)}, but is {name!r}"
            )
        target = targets.TARGETS[name]
        root = Path(self.root)
        # a folder that keeps what is built, for the next time
        kept = os.environ.get("NGSPICE_BUILD")
        work = Path(kept or tempfile.mkdtemp(prefix="ngspice-")) / name
        try:
            found = source.unpacked(source.archive(root), work / "source")
            made = build.build(found, work, target)
        except (source.NoSourceError, build.BuildError) as error:
            self.app.abort(str(error))
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{target.tag}"
        files = {path: path.name for path in made}
        files |= {found / "COPYING": "licences/ngspice.txt"}
        files |= {
            build.compiler() / path: f"licences/{name}.txt" for name, path in LICENCES.items()
        }
        build_data["force_include"] |= {
            str(path): f"{PACKAGE}/{name}" for path, name in files.items()
        }
