"""The page of the forms of files: the right value of each form, and the value that is read.

    python benchmarks/file_forms.py      writes docs/file_forms.md

Each row of tests/support/file_forms.py is a small file, made from numbers that are known.
"""

import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.support.file_forms import FORMS  # noqa: E402

PAGE = ROOT / "docs/file_forms.md"
HEAD = """# Forms of files that are read

Analysers, profilers and standards write one quantity in many forms. Each row is a small file of a form, made from
numbers that are known: the column *right* follows from these numbers, the column *read* is read from the file. A test
compares both to 1e-6, and this page with the files (`tests/records/test_file_forms.py`).
"""
KINDS = {
    "impedance": """## Impedance, for `identify`

The synthetic impedance of a device near its resonance, with 0.1 % of noise, at 92.5 Hz. A file
with a magnitude alone gives no phase: the answer states so, and its intervals are wider. A table with a reflection
(S11) alone is refused, since it does not state the reference impedance: export it as a Touchstone file.
""",
    "current": """## Current over time, for a node's `trace`

A pulse of 5 mA on a sleep current of 2 uA, 400 samples in 40 ms, with three samples of -48 nA, as of a profiler whose
zero is off. Samples below 0 count as 0 and are reported; if they carry more than 1 % of the charge, the file is
refused. The number is the charge. A file with the currents of two channels is refused with the names of both.
""",
    "density": """## Power spectral density, for `acceleration_psd_file`

The number is the rms acceleration. Breakpoints are joined by straight lines on log-log axes; a multiple of 3 dB per
octave is a factor of two. A slope holds from its row to the next one, or between the two ends of a range.
""",
}


def page(folder):
    """The page; files are written into ``folder``."""
    lines = [HEAD]
    for kind, text in KINDS.items():
        lines += [text, "| form | line above the numbers | right | read |", "|---|---|---|---|"]
        for form in FORMS:
            if form.kind == kind:
                head = f"`{_escaped(form.head)}`" if form.head else "a block for each trace"
                values = f"{form.shown(form.right)} | {form.shown(form.value(folder))}"
                lines.append(f"| {_escaped(form.name)} | {head} | {values} |")
        lines.append("")
    return "\n".join(lines).rstrip() + "\n"


def _escaped(text):
    """A text in a cell of a table."""
    return text.replace("\t", " ").replace("|", "\\|")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        PAGE.write_text(page(Path(place)))
