"""Compiled kernels that a checkout has outgrown are removed.

Numba keeps a compiled kernel beside its source and compiles anew when that file changes. What the kernel takes from
other files - constants, other kernels - is compiled into it, so that after an update of a checkout it may compute
yesterday's numbers, or crash. Installed packages are not concerned: all their files are new.
"""

from __future__ import annotations

import ast
import json
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

#: what the files of kernels contain, and no others
_MARKS = ("from numba import", "bodyplan.kernels import", "bodyplan.spatial.lanes import")
#: where the state of files is kept from which the compiled kernels come
_RECORD = Path("__pycache__") / "kernels.json"


def forget_stale_of_checkout(package: Path) -> None:
    """:func:`forget_stale`, if the ``package`` is one of a checkout and its files can be written."""
    with suppress(Exception):  # nothing here may keep anybody from importing the package
        if (package.parent.parent / ".git").exists():
            forget_stale(package)


def forget_stale(package: Path) -> list[Path]:
    """Remove compiled kernels of the ``package`` (a folder) that were made from files that are no longer the same;
    returns the sources of those kernels. Raises OSError where files cannot be read or removed."""
    before = _recorded(package / _RECORD)
    if before and all(_state(package / name) == state for name, state in before.items()):
        return []
    kernels = {path: set(_taken(package, path)) for path in package.rglob("*.py") if _has_kernels(path)}
    files = {path.relative_to(package).as_posix(): path for path in {*kernels, *set().union(*kernels.values())}}
    now = {name: _state(path) for name, path in files.items()}
    changed = {path for name, path in files.items() if before.get(name) != now[name]}
    # whoever took something from a file that is gone no longer says so
    gone = any(not (package / name).is_file() for name in before)
    stale = [path for path in sorted(kernels) if gone or _reached(kernels, path) & changed]
    for path in stale:
        for compiled in path.parent.glob(f"__pycache__/{path.stem}.*.nb[ci]"):
            compiled.unlink(missing_ok=True)
    record = package / _RECORD
    record.parent.mkdir(exist_ok=True)
    passing = record.with_suffix(f".{os.getpid()}")
    try:
        passing.write_text(json.dumps(now), encoding="utf-8")
        passing.replace(record)
    finally:
        passing.unlink(missing_ok=True)
    return stale


def _recorded(record: Path) -> dict[str, list[int]]:
    with suppress(OSError, ValueError, RecursionError):
        found = json.loads(record.read_text(encoding="utf-8"))
        if isinstance(found, dict):
            return found
    return {}


def _state(path: Path) -> list[int] | None:
    """Time and size of a file, None where there is none to be had."""
    try:
        found = path.stat()
    except (OSError, ValueError):
        return None
    return [found.st_mtime_ns, found.st_size]


def _text(path: Path) -> str:
    """What a file says; nothing where it cannot be read, as a lock that an editor leaves."""
    with suppress(OSError, ValueError):
        return path.read_text(encoding="utf-8")
    return ""


def _has_kernels(path: Path) -> bool:
    text = _text(path)
    return any(mark in text for mark in _MARKS)


def _taken(package: Path, path: Path) -> Iterator[Path]:
    """The files of the package that a file imports from."""
    try:
        tree = ast.parse(_text(path))
    except (SyntaxError, ValueError, RecursionError):
        return  # nobody can import it either
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.split(".")[0] == package.name:
            module = package.joinpath(*node.module.split(".")[1:])
            for place in (module.with_suffix(".py"), *(module / f"{name.name}.py" for name in node.names)):
                if place.is_file():
                    yield place


def _reached(kernels: dict[Path, set[Path]], path: Path) -> set[Path]:
    """The file, and all from which it takes something: files of kernels with what these take in turn."""
    reached, waiting = set[Path](), [path]
    while waiting:
        one = waiting.pop()
        if one not in reached:
            reached.add(one)
            waiting += kernels.get(one, ())
    return reached
