"""Files that are given to the page: kept in a folder of its session, and trusted in nothing.

A scene reaches no file outside of that folder, and neither does a netlist
(`harvester.netlists.allowed`).
"""

import re
from pathlib import Path

from harvester.errors import InputError, shown
from harvester.explore.draft import Draft
from harvester.machine import files
from harvester.records.cleaning import clean
from harvester.records.record_facts import RecordFacts
from harvester.studies.record import record_spectra

KINDS = (".toml", ".csv", ".cir")
MOST_BYTES = 50_000_000  # of all that a session has been given
_NAME = re.compile(r"[A-Za-z0-9][\w.+ -]{0,99}")


def keep(folder: Path, names: list[str], contents: list[bytes]) -> list[Path]:
    """Write files into the session's folder.

    Raises InputError for a name that is not one of a plain file of `KINDS`, and for too many bytes.
    """
    if sum(file.stat().st_size for file in folder.iterdir()) + sum(map(len, contents)) > MOST_BYTES:
        raise InputError(
            f"the files of a page must have at most {MOST_BYTES // 1_000_000} MB together, but have more"
        )
    kept = []
    for name, content in zip(names, contents, strict=True):
        if not _NAME.fullmatch(name) or Path(name).suffix.lower() not in KINDS:
            raise InputError(
                f"a file must be a scene (.toml), a record (.csv) or a netlist (.cir), but is {shown(name)}"
            )
        files.write(folder / name, content, "file")
        kept.append(folder / name)
    return kept


def take(draft: Draft, paths: list[Path], axis: str) -> tuple[Draft, list[str]]:
    """The draft with what the files bring, and what to tell of them: a scene first, then its netlist and record.

    ``axis`` is that of a record with several columns, empty for the only one.  Raises InputError in
    one line for anything that cannot be used; the draft that was given stays as it was.
    """
    draft = draft.copy()
    messages = list[str]()
    for path in sorted(paths, key=lambda file: KINDS.index(file.suffix.lower())):
        match path.suffix.lower():
            case ".toml":
                draft = _scene(path)
                messages.append(f"scene {path.name}")
            case ".csv" if any(Path(record).name == path.name for record in draft.files.values()):
                # that of the scene, which has its own reader
                messages.append(f"record {path.name}")
            case ".csv":
                messages += _record(draft, path, axis)
            case _:
                draft.own_netlist(str(path))
                messages.append(f"netlist {path.name}")
    draft.check_knobs()
    draft.scene()
    return draft, messages


def _scene(path: Path) -> Draft:
    try:
        return Draft.of_text(path.read_bytes().decode(), path.parent)
    except UnicodeDecodeError:
        raise InputError(f"scene must be UTF-8 text, but {shown(path.name)} is not") from None


def _record(draft: Draft, path: Path, axis: str) -> list[str]:
    """Make a record clean and let it shake the base."""
    if not draft.physical:
        raise InputError(
            "a record must go with a scene in SI units, but this one is nondimensional"
        )
    try:
        report = record_spectra(clean(str(path), RecordFacts(axis=axis or None)))
    except InputError as error:
        raise InputError(
            re.sub(r"\bFILE\b", lambda _: path.name, str(error), count=1).replace(
                "--axis", "the field 'axis'"
            )
        ) from None
    cleaned = path.with_name(f"{path.stem}_clean.csv") if not path.stem.endswith("_clean") else path
    files.write(cleaned, report.text(), "file")
    draft.files["excitation.acceleration_file"] = str(cleaned)
    recorded = next(
        effect for effect in draft.effects if effect.keys == ("excitation.acceleration_file",)
    )
    draft.switch(recorded, True)
    for effect in draft.effects:
        if effect.choice == "noise":
            draft.switch(effect, False)
    rms = f"rms {report.record.rms:.4g} m/s^2, {len(report.record.values)} samples"
    return [
        f"record {path.name}: {rms}",
        *map(str, (*report.record.notes, *report.record.warnings)),
    ]
