"""A robot's formulas and C source as files."""

from __future__ import annotations

from pathlib import Path

from bodyplan.errors import InputError
from bodyplan.files import refuse_existing, replacing
from bodyplan.robot.source_text import identifier
from bodyplan.robot.symbolic.model import SymbolicRobot


def write_model(
    model: SymbolicRobot, *, symbolic: bool = True, c: Path | None = None, out: Path | None = None, force: bool = False
) -> list[Path]:
    """Write NAME.tex and NAME.py (``symbolic``) into the folder ``out`` (default: ``c``, or runs/model-NAME), NAME.h
    and NAME.c into the folder ``c`` where given; missing folders are made. Returns the paths.

    Everything is computed and every place is looked at before the first file appears. Raises InputError where a file
    exists (unless ``force``) or a folder cannot be one.
    """
    name = identifier(model.robot.name, prefix="robot")
    files: dict[Path, str] = {}
    if symbolic:
        folder = out or c or Path("runs") / f"model-{name}"
        files[folder / f"{name}.tex"] = model.latex(document=True)
        files[folder / f"{name}.py"] = model.python()
    if c is not None:
        source = model.c_source(name)
        files[c / f"{name}.h"], files[c / f"{name}.c"] = source.header, source.source
    for path in files:
        refuse_existing(path, force)
    for folder in dict.fromkeys(path.parent for path in files):
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{folder}: cannot be a folder to write to ({error.strerror}).") from error
    for path, text in files.items():
        with replacing(path) as file:
            file.write(text)
    return list(files)
