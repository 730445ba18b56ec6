"""The parts that differ between operating systems: `this_system`, chosen here, so that no other file asks for it.

Each system's class has the same methods, which the checker of types sees on each.
"""

import sys

if sys.platform == "win32":
    from harvester.machine.system.windows import Windows as _ThisSystem
elif sys.platform == "darwin":
    from harvester.machine.system.posix import MacOS as _ThisSystem
else:
    from harvester.machine.system.posix import Linux as _ThisSystem

this_system = _ThisSystem()
