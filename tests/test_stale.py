"""Compiled kernels are forgotten when a file that they come from changes, and only then."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import bodyplan as bp
from bodyplan.stale import forget_stale, forget_stale_of_checkout

SOURCES = {
    "__init__.py": "",
    "sizes.py": "SIZE = 3\n",
    "inner.py": "from numba import njit\nfrom toy.sizes import SIZE\n",
    "outer.py": "from numba import njit\nfrom toy.inner import inner\n",
    "other.py": "from toy.kernels import lean\nfrom bodyplan.kernels import lean\n",
    "plain.py": "from toy.outer import outer\n",
    "part/__init__.py": "",
    "part/deep.py": "from numba import njit\nfrom toy.part import near\n",
    "part/near.py": "WIDTH = 1.0\n",
}
KERNELS = ("inner", "outer", "other", "part/deep")


def compiled(package: Path, kernel: str) -> list[Path]:
    source = package / f"{kernel}.py"
    return [source.parent / "__pycache__" / f"{source.stem}.f-1.py311.{end}" for end in ("nbi", "1.nbc")]


def compile_all(package: Path) -> None:
    for kernel in KERNELS:
        for path in compiled(package, kernel):
            path.parent.mkdir(exist_ok=True)
            path.touch()


def left(package: Path) -> set[str]:
    there = {kernel: [path.exists() for path in compiled(package, kernel)] for kernel in KERNELS}
    assert all(len(set(found)) == 1 for found in there.values())
    return {kernel for kernel, found in there.items() if found[0]}


@pytest.fixture
def package(tmp_path: Path) -> Path:
    made = tmp_path / "toy"
    for name, text in SOURCES.items():
        path = made / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    forget_stale(made)
    compile_all(made)
    return made


def touch(path: Path) -> None:
    found = path.stat()
    os.utime(path, ns=(found.st_atime_ns, found.st_mtime_ns + 1_000_000_000))


def test_nothing_changed(package: Path) -> None:
    assert forget_stale(package) == []
    assert left(package) == set(KERNELS)


@pytest.mark.parametrize(
    ("changed", "stale"),
    [
        ("sizes.py", {"inner", "outer"}),
        ("inner.py", {"inner", "outer"}),
        ("outer.py", {"outer"}),
        ("part/near.py", {"part/deep"}),
        ("plain.py", set()),
    ],
)
def test_what_is_made_from_a_changed_file(package: Path, changed: str, stale: set[str]) -> None:
    touch(package / changed)
    assert set(forget_stale(package)) == {package / f"{kernel}.py" for kernel in stale}
    assert left(package) == set(KERNELS) - stale
    compile_all(package)
    assert forget_stale(package) == []


def test_a_file_that_went_and_one_that_came(package: Path) -> None:
    (package / "sizes.py").unlink()
    assert package / "outer.py" in forget_stale(package)
    compile_all(package)
    (package / "sizes.py").write_text("SIZE = 4\n")
    touch(package / "inner.py")
    assert package / "outer.py" in forget_stale(package)


def test_kernels_of_unknown_age_are_forgotten(package: Path) -> None:
    (package / "__pycache__" / "kernels.json").write_text("no json")
    forget_stale(package)
    assert left(package) == set()


def test_what_cannot_be_read_is_passed_over(package: Path) -> None:
    (package / "half.py").write_text("from numba import njit\n<<<<<<< HEAD\n")
    (package / "latin.py").write_bytes(b"# from numba import \xe9\n")
    (package / ".#lock.py").symlink_to(package / "nowhere")
    (package / "folder.py").mkdir()
    (package / "deep.py").write_text("from numba import njit\n" + "(" * 5000)
    touch(package / "sizes.py")
    assert {path.stem for path in forget_stale(package)} >= {"inner", "outer"}
    assert left(package) == {"other", "part/deep"}


@pytest.mark.parametrize("record", ['{"a\\u0000b": [1, 2]}', "[" * 100_000, "[1]", "{}", '{"sizes.py": 3}'])
def test_broken_records(package: Path, record: str) -> None:
    (package.parent / ".git").mkdir()
    (package / "__pycache__" / "kernels.json").write_text(record)
    forget_stale_of_checkout(package)
    assert left(package) <= set(KERNELS)


def test_no_checkout_is_left_alone(package: Path) -> None:
    touch(package / "sizes.py")
    forget_stale_of_checkout(package)
    assert left(package) == set(KERNELS)
    forget_stale_of_checkout(Path("/bodyplan"))


def test_kernels_of_this_package_are_known() -> None:
    """Those that come from the spline's, for one, and no others than there are."""
    from bodyplan import stale

    package = Path(bp.__file__).parent
    kernels = {path: set(stale._taken(package, path)) for path in package.rglob("*.py") if stale._has_kernels(path)}
    spline = package / "ground" / "spline_kernel.py"
    users = {path.name for path in kernels if spline in stale._reached(kernels, path)}
    assert {"spline_kernel.py", "field_kernel.py", "contact_kernel.py", "search_kernel.py"} <= users
    assert "tape_kernel.py" not in users
