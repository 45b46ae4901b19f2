"""bodyplan doctor: what is installed, what is missing, what it is for."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import platform
import shutil
import sys
from collections.abc import Iterator
from typing import NamedTuple

import typer

from bodyplan.terminal import bad_input, print_table, say

#: library -> (its module, extra or "" for the core, what it is for)
LIBRARIES = {
    "numpy": ("numpy", "", "arrays"),
    "numba": ("numba", "", "kernels"),
    "scipy": ("scipy", "", "splines, root finders"),
    "pydantic": ("pydantic", "", "mission files"),
    "pint": ("pint", "", "units"),
    "mujoco": ("mujoco", "physics", "physics: bodyplan run, bp.simulate"),
    "matplotlib": ("matplotlib", "report", "figures"),
    "plotly": ("plotly", "report", "report.html"),
    "sympy": ("sympy", "symbolic", "formulas and C99 source"),
    "clarabel": ("clarabel", "solve", "contact forces, rates within limits"),
    "mcap-ros2-support": ("mcap_ros2", "ros", "MCAP logs for ROS 2"),
    "trimesh": ("trimesh", "gltf", "animated glTF (.glb)"),
    "viser": ("viser", "view", "live viewer: bodyplan view"),
    "distributed": ("distributed", "cluster", "bodyplan sweep"),
    "optuna": ("optuna", "search", "bodyplan optimise"),
}
#: oldest Python
PYTHON = (3, 11)
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome", "firefox")


class Finding(NamedTuple):
    """One line of the doctor: ``what`` was looked at, what was ``found``, whether it is ``ok`` (None: a choice that is
    not taken), and what it is ``for_`` or how to get it."""

    what: str
    found: str
    ok: bool | None
    for_: str


def findings() -> Iterator[Finding]:
    """Everything that bodyplan may need, the core first."""
    version = platform.python_version()
    fits = sys.version_info >= PYTHON
    yield Finding("Python", version, fits, "3.11 or newer" if fits else "too old: bodyplan needs 3.11 or newer")
    for name, (module, extra, purpose) in LIBRARIES.items():
        if importlib.util.find_spec(module) is not None:
            try:
                yield Finding(name, importlib.metadata.version(name), True, purpose)
            except importlib.metadata.PackageNotFoundError:
                again = f"pip install --force-reinstall {name}"
                yield Finding(name, "only in parts", False, f"{purpose}; get it with: {again}")
        elif extra:
            yield Finding(name, "missing", None, f"{purpose}; get it with: pip install 'bodyplan[{extra}]'")
        else:
            yield Finding(name, "missing", False, f"{purpose}; get it with: pip install --force-reinstall bodyplan")
    yield _physics()
    compiler = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
    yield Finding("C compiler", compiler or "none", None if compiler is None else True, "to try exported C99 source")
    browser = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    yield Finding(
        "browser",
        browser or "none found",
        None if browser is None else True,
        "reports and the viewer open in any browser",
    )


def _physics() -> Finding:
    """Whether MuJoCo can step a model here."""
    if importlib.util.find_spec("mujoco") is None:
        return Finding("physics", "not tried", None, "MuJoCo is missing")
    try:
        import mujoco

        model = mujoco.MjModel.from_xml_string(
            "<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>"
        )
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data)
    except Exception as error:  # whatever a broken installation raises is the finding
        return Finding("physics", "fails", False, f"{type(error).__name__}: {error}")
    return Finding("physics", "steps", True, "a falling ball, one step")


def doctor() -> None:
    """Say what is installed, what is missing and how to get it."""
    with bad_input():
        from bodyplan import __version__

        say(f"bodyplan {__version__} on {platform.system()} {platform.machine()}", bold=True)
        found = list(findings())
        words = {True: "ok", False: "BROKEN", None: "-"}
        print_table(["", "found", "", "what for"], [[f.what, f.found, words[f.ok], f.for_] for f in found])
        broken = [f.what for f in found if f.ok is False]
        missing = [f.what for f in found if f.ok is None]
        if broken:
            say(f"does not work: {', '.join(broken)}", fg=typer.colors.RED)
        elif missing:
            typer.echo(
                f"works; without {', '.join(missing)} some commands do not. Everything: pip install 'bodyplan[all]'"
            )
        else:
            typer.echo("all there")
    raise typer.Exit(1 if broken else 0)
