"""How fast a concertina goes in corridors of several widths and frictions: a table and a chart to read off.

    python examples/corridor_chart.py --widths 60 80 100 120 160 200 --frictions 0.5 0.75 1

For each corridor it looks for the fastest gait of a snake (mission concertina-tuned: 26 links, joints at 1 rad/s) that
keeps 95 % of its planned advance with at most 0.5 N m. The folded body must be a little wider than the corridor: this
squeeze is its grip. Modules, omega and width are tied by it: for each number of modules omega is tried only where the
squeeze is some millimetres. A small sweep for each number of modules comes first, then an optimisation of the best
ones, from the best point on; what is planned no faster than the best so far is not executed there. Both run coarser
physics, and the best of what they find has to stand in the mission's own. So have gaits that were found for the same
width and another friction.

Everything is kept in the folder: the same command goes on where it was stopped, one with other corridors adds to it.
"""

import argparse
import csv
import json
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

import bodyplan as bp
from bodyplan.job import plan_mission, simulate_mission

#: tried for each number of modules, with a small and a middle squeeze
FIRST = {"gait.waves": [1, 2], "gait.extension": [0.2, 0.335]}
#: searched for the best of them, beside omega; the extension up to so much from the best one of the first
VARY = {"gait.waves": "1:3", "gait.overlap": "0:0.3", "gait.gamma_max": "0.45:0.8"}
AROUND = 0.1
#: mm: how much wider than the corridor the folded body may be
SQUEEZE = 2.0, 12.0
#: folds are too flat or too full for the links beyond
OMEGAS = np.geomspace(0.4, 4.0, 60)
LEAST_RATIO, MOST_TORQUE = 0.95, 0.5
#: physics of the searches: a third of the time; it finds less torque and a little less advance
COARSE = ["time.cycles=1", "simulate.cycles=1", "simulate.dt=0.002"]
COARSE_RATIO, COARSE_TORQUE = LEAST_RATIO - 0.01, MOST_TORQUE - 0.04
BOUNDS = [f"trial.advance_ratio>={COARSE_RATIO}", f"trial.peak_torque<={COARSE_TORQUE}"]
MEASURED = "advance_ratio", "peak_torque_Nm", "speed_m_s"
SHOWN = ("modules", "omega", "extension", "waves", "overlap", "gamma_max", "squeeze_mm")


def asked():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--widths", type=float, nargs="+", default=[60, 80, 100, 120, 140, 170, 200], help="mm")
    parser.add_argument("--frictions", type=float, nargs="+", default=[0.5, 0.75, 1.0], help="of the walls")
    parser.add_argument("--modules", type=int, nargs="+", default=list(range(2, 17, 2)), help="to choose from")
    parser.add_argument("--searched", type=int, default=2, help="numbers of modules that are searched on")
    parser.add_argument("--trials", type=int, default=24, help="of the search for each of them")
    parser.add_argument("--batch", type=int, default=4)
    parser.add_argument("--tried", type=int, default=4, help="of what is found, in full physics, at most")
    parser.add_argument("--workers", type=int, default=None, help="processes (default: one a core)")
    parser.add_argument("--scheduler", default=None, help="of a running dask cluster")
    parser.add_argument("--mission", default="concertina-tuned")
    parser.add_argument("--set", action="append", default=[], metavar="FIELD=VALUE", help="for all corridors")
    parser.add_argument("--out", type=Path, default=Path("runs/corridors"))
    return parser.parse_args()


def widths_of(robot, modules):
    """Omegas whose folds the links fit, and the width in mm of the folded body at each; the width rises with omega."""
    found = []
    for omega in OMEGAS:
        try:
            body = bp.Concertina(modules, omega=float(omega), contraction="mirror", warp=False).body(robot)
        except bp.BodyplanError:
            body = None
        if body is not None and body.tight < 0 and (not found or 1e3 * body.width > found[-1][1]):
            found.append((float(omega), 1e3 * body.width))
        elif found:
            break
    return np.array(found).reshape(-1, 2)


def omegas_for(table, width):
    """Omega with the least squeeze, a small, a middle and the most squeeze in a corridor of ``width`` mm; None where
    there is none."""
    low, high = SQUEEZE
    wanted = width + np.array([low, 0.65 * low + 0.35 * high, 0.35 * low + 0.65 * high, high])
    if len(table) < 2 or table[0, 1] > wanted[0] or wanted[2] > table[-1, 1]:
        return None
    return [float(f"{omega:.5g}") for omega in np.interp(wanted, table[:, 1], table[:, 0])]


def executed(mission):
    """Figures of the mission in its own physics."""
    motion = plan_mission(mission)
    trial = simulate_mission(mission, motion)
    well = trial.ok and bp.check(motion).ok
    return {
        "speed_mm_s": 1e3 * trial.speed if well else None,
        "advance_ratio": trial.advance_ratio if well else None,
        "peak_torque_Nm": trial.peak_torque if well else None,
        "planned_mm_s": 1e3 * motion.facts["speed"],
        "squeeze_mm": 1e3 * motion.facts["squeeze"],
    }


def missed(figures, ratio=LEAST_RATIO, torque=MOST_TORQUE):
    """By how much of them the bounds are missed, 0 where they are kept."""
    short, strong = 1.0 - figures["advance_ratio"] / ratio, figures["peak_torque_Nm"] / torque - 1.0
    return max(0.0, short) + max(0.0, strong)


class Corridor:
    """The search in one corridor, width in mm."""

    def __init__(self, options, width, friction, scheduler):
        self.options, self.scheduler = options, scheduler
        self.here = options.out / f"width-{width:g}-friction-{friction:g}"
        self.ground = [f"ground.width={width / 1e3!r}", f"ground.wall_friction={friction!r}", *options.set]
        self.row = {"width_mm": width, "friction": friction, "trials": 0, "seconds": 0.0}
        #: of every trial that was executed: what it misses, minus its speed, modules, changes; the best first
        self.found = []

    def mission(self, modules, omega, start=()):
        """The mission in this corridor, in coarser physics."""
        sets = [*self.ground, *COARSE, f"gait.body_modules={modules}", f"gait.omega={omega!r}", *start]
        return bp.load_mission(self.options.mission, sets)

    def first(self, modules, omegas):
        """A sweep for one number of modules."""
        over = FIRST | {"gait.omega": omegas[1:3]}
        out = self.here / f"first-{modules}"
        made = bp.sweep(self.mission(modules, omegas[1]), over, out, scheduler=self.scheduler, force=True)
        self.keep(modules, [(point.overrides, row) for point, row in zip(made.points, made.rows, strict=True)])

    def then(self, modules, omegas):
        """A search from the best point of one number of modules on."""
        apart, speed, _, _ = self.found[0]
        start = next(changes for _, _, mine, changes in self.found if mine == modules)
        mission = self.mission(modules, omegas[1], start)
        around = max(0.05, mission.gait.extension - AROUND), min(1.0, mission.gait.extension + AROUND)
        made = bp.optimise(
            mission,
            VARY | {"gait.omega": (omegas[0], omegas[3]), "gait.extension": around},
            maximise="trial.speed",
            subject_to=[*BOUNDS, *([] if apart else [f"plan.speed>={-speed:.6g}"])],
            trials=self.options.trials,
            batch=self.options.batch,
            out=self.here / f"then-{modules}",
            scheduler=self.scheduler,
            force=True,
        )
        self.keep(modules, [(made.overrides(i), trial.row) for i, trial in enumerate(made.trials)])

    def keep(self, modules, points):
        """Add points to those that are found."""
        for changes, row in points:
            self.row["trials"] += 1
            self.row["seconds"] += row.seconds
            if row.ok:
                figures = {name: row.figures[f"trial.{name}"] for name in MEASURED}
                apart = missed(figures, COARSE_RATIO, COARSE_TORQUE)
                sets = [f"gait.body_modules={modules}", *changes]
                self.found.append((apart, -figures["speed_m_s"], modules, sets))
        self.found.sort()

    def best(self, tables):
        """The row of the table."""
        omegas = {modules: omegas_for(table, self.row["width_mm"]) for modules, table in tables.items()}
        for modules, band in omegas.items():
            if band is not None:
                self.first(modules, band)
        if not self.found:
            return self.row | {"note": "no body of these modules fits and can be executed"}
        options, ranked = self.options, list(dict.fromkeys(modules for _, _, modules, _ in self.found))
        for modules in ranked[: options.searched]:
            self.then(modules, omegas[modules])
        tried = [[*self.ground, *changes] for _, _, _, changes in self.found[: options.tried]]
        kept, nearest = [], []
        for sets in [*tried, *([*self.ground, *gait] for gait in self.others())]:
            if kept and sets in tried:
                continue  # those that follow are slower
            figures = remembered(self.here / "executed.json", options.mission, sets)
            if figures["speed_mm_s"] is None:
                continue
            gait = bp.load_mission(options.mission, sets).gait
            chosen = {name: getattr(gait, name) for name in ("omega", "extension", "waves", "overlap", "gamma_max")}
            row = self.row | figures | {"modules": gait.body_modules} | chosen | {"sets": " ".join(sets)}
            if missed(figures) == 0.0:
                kept.append((-figures["speed_mm_s"], len(kept), row))
            else:
                nearest.append((missed(figures), len(nearest), row))
        if kept:
            return min(kept)[2]
        note = f"of {len(self.found)} that were executed none keeps the bounds"
        return min(nearest)[2] | {"note": f"{note}; the nearest one"} if nearest else self.row | {"note": note}

    def others(self):
        """Gaits of the table for walls of this width and other frictions: they may do here, too."""
        mine = [
            row for row in read(self.options.out / "corridors.csv") if float(row["width_mm"]) == self.row["width_mm"]
        ]
        return [[word for word in row["sets"].split() if word.startswith("gait.")] for row in mine if row["sets"]]


def remembered(path, mission, sets):
    """Figures of the mission with ``sets``, from the file where they are there."""
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    key = " ".join([mission, *sets])
    if key not in known:
        known[key] = executed(bp.load_mission(mission, sets))
        path.write_text(json.dumps(known, indent=1), encoding="utf-8")
    return known[key]


def read(path):
    """The rows of a table, none where there is none."""
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write_table(rows, path):
    """All rows, and those of corridors that an earlier run has found."""
    old = read(path)
    mine = {(f"{row['width_mm']:g}", f"{row['friction']:g}") for row in rows}
    old = [row for row in old if (f"{float(row['width_mm']):g}", f"{float(row['friction']):g}") not in mine]
    names = ["width_mm", "friction", "speed_mm_s", "advance_ratio", "peak_torque_Nm", "planned_mm_s", *SHOWN,
             "trials", "seconds", "note", "sets"]  # fmt: skip
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, names, lineterminator="\n")
        writer.writeheader()
        whole = [*old, *({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()} for row in rows)]
        writer.writerows(sorted(whole, key=lambda row: (float(row["friction"]), float(row["width_mm"]))))


def draw(path):
    """Speed over width, a line a friction, and below it what the gait is; from the table. False where there is
    nothing to draw."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    rows = [row for row in read(path) if row["speed_mm_s"]]
    if not rows:
        return False
    frictions = sorted({float(row["friction"]) for row in rows})
    colours = plt.cm.viridis(np.linspace(0.0, 0.8, len(frictions)))
    figure = plt.figure(figsize=(10, 8.5), layout="constrained")
    grid = figure.add_gridspec(4, 3)
    panels = {"speed_mm_s": figure.add_subplot(grid[:2, :])}
    small = ("modules", "omega", "squeeze_mm", "extension", "waves", "gamma_max")
    panels |= {name: figure.add_subplot(grid[2 + i // 3, i % 3]) for i, name in enumerate(small)}
    titles = {"speed_mm_s": "speed (mm/s)", "squeeze_mm": "squeeze (mm)"}
    for name, axes in panels.items():
        for k, friction in enumerate(frictions):
            mine = [row for row in rows if float(row["friction"]) == friction]
            x, y = ([float(row[key]) for row in mine] for key in ("width_mm", name))
            drawn = {"marker": "osD^vP"[k % 6], "color": colours[k], "clip_on": False}
            axes.plot(x, y, label=f"friction {friction:g}", **drawn)
            short = [i for i, row in enumerate(mine) if row["note"]]
            if short:
                axes.plot([x[i] for i in short], [y[i] for i in short], linestyle="", markerfacecolor="white", **drawn)
        axes.set_title(titles.get(name, name), loc="left", fontsize="medium")
        axes.grid(alpha=0.3)
        axes.set_ylim(bottom=0.0)
    top = panels["speed_mm_s"]
    top.set_xlabel("width of the corridor (mm)")
    if any(row["note"] for row in rows):
        top.plot([], [], "o", color="grey", markerfacecolor="white", label="nearest one that misses a bound")
    top.legend(frameon=False)
    figure.suptitle(
        f"Concertina, joints at 1 rad/s: fastest with {LEAST_RATIO:.0%} of the planned advance and {MOST_TORQUE:g} N m",
        x=0.01,
        ha="left",
    )
    for end in (".png", ".svg"):
        figure.savefig(path.with_suffix(end), dpi=150)
    return True


@contextmanager
def processes(workers):
    """Address of processes here, one set for all searches; a point each at a time."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster:
        yield cluster.scheduler_address


def main():
    options = asked()
    options.out.mkdir(parents=True, exist_ok=True)
    robot = bp.load_mission(options.mission, options.set).robot
    tables = {modules: widths_of(robot, modules) for modules in options.modules}
    rows = []
    with ExitStack() as stack:
        scheduler = options.scheduler or stack.enter_context(processes(options.workers))
        for width in options.widths:
            for friction in options.frictions:
                row = Corridor(options, width, friction, scheduler).best(tables)
                rows.append(row)
                said = {name: f"{value:.4g}" for name, value in row.items() if isinstance(value, (int, float))}
                print(", ".join(f"{name} {value}" for name, value in said.items()), row.get("note", ""), flush=True)
                write_table(rows, options.out / "corridors.csv")
    if draw(options.out / "corridors.csv"):
        print(f"{options.out / 'corridors.csv'}, .png, .svg")


if __name__ == "__main__":
    main()
