"""Searches in real processes: what workers find is what this process finds, however many there are, whatever becomes
of them, and wherever a search was stopped."""

import csv
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import bodyplan as bp
import search_cases
from bodyplan.search import cluster
from bodyplan.search.store import store_at
from search_cases import MISSION, OVER, alone, cluster_of_processes, lines, mission

pytest.importorskip("mujoco")
pytest.importorskip("distributed")
pytest.importorskip("optuna")


@pytest.fixture(scope="module")
def reference():
    """Every point of OVER, worked out here one after another."""
    from bodyplan.search.parameters import axes_of
    from bodyplan.search.sweeps import _points

    return {point.overrides: alone(point) for point in _points(axes_of(OVER))}


@pytest.fixture(scope="module")
def processes(tmp_path_factory):
    with cluster_of_processes(tmp_path_factory.mktemp("cluster"), 2) as (address, workers):
        yield address, workers


def rows(made):
    return {p.overrides: (r.status, dict(r.figures)) for p, r in zip(made.points, made.rows, strict=True)}


def test_a_local_cluster_and_a_point_that_ends_its_worker(tmp_path, monkeypatch, processes, reference):
    """Two processes here; one point kills whichever has it. All others are what they are alone, in the order of the
    grid; the point is lost, is not kept, and is well when the sweep goes on with workers that live."""
    monkeypatch.setattr(cluster, "on_worker", search_cases.poisoned)
    monkeypatch.setitem(cluster.DEALING, "distributed.scheduler.allowed-failures", 0)  # each costs a new process
    made = bp.sweep(mission(), OVER, tmp_path / "s", workers=2)
    found = rows(made)
    (bad,) = [key for key, (status, _) in found.items() if status == "lost"]
    assert bad == ("gait.omega=1.4", 'ground.width="160 mm"')
    assert list(found) == list(reference)
    assert {key: row for key, row in found.items() if key != bad} == {k: v for k, v in reference.items() if k != bad}
    assert "memory" in made.rows[list(found).index(bad)].reason
    monkeypatch.undo()
    address, _ = processes
    again = bp.sweep(mission(), OVER, tmp_path / "s", scheduler=address)
    assert rows(again) == reference and again.complete
    keys = [line["key"] for line in lines(tmp_path / "s")]
    assert len(keys) == len(set(keys)) == len(reference)


def test_another_client_of_the_user_does_not_get_in_the_way(processes, reference):
    """A client made later, which dask takes for the default one, is busy all the while: the rows come without it."""
    import threading

    from distributed import Client

    from bodyplan.search.payload import key_of, payload_of

    address, _ = processes
    payload, changes = payload_of(mission()), next(iter(reference))
    done, waited = threading.Event(), []
    with cluster.pool(scheduler=address) as workers, Client(address) as busy:
        busy.loop.add_callback(lambda: waited.append(done.wait(60.0)))
        found = list(workers.rows(payload, [(key_of(payload, changes, {}), changes)], True))
        done.set()
        busy.sync(busy.scheduler.identity)  # after the callback
    assert waited == [True]
    assert [(row.status, dict(row.figures)) for _, row in found] == [reference[changes]]


def test_short_points_share_a_task_long_ones_do_not(processes, monkeypatch):
    """What takes no time travels in tasks of several points, each point's row comes once; tasks get smaller at the
    end, so that workers end together, and are of one point where a point is work enough."""
    from bodyplan.search.payload import key_of, payload_of

    address, _ = processes
    payload = payload_of(mission())
    jobs = [(key_of(payload, change, {}), change) for change in ((f"ground.width=-{k}.0",) for k in range(1, 61))]
    sizes = []
    with cluster.pool(scheduler=address) as workers:
        whole = workers._client.map

        def spied(function, *arguments, key):
            sizes.extend(map(len, arguments[3]))
            return whole(function, *arguments, key=key)

        monkeypatch.setattr(workers._client, "map", spied)
        for seconds in (0.001, 0.3, 2.0):
            workers._seconds.extend([seconds] * cluster.LATEST)
            sizes.clear()
            found = list(workers.rows(payload, jobs, True))
            assert sorted(key for key, _ in found) == sorted(key for key, _ in jobs)
            rows_of = dict(found)
            assert all(rows_of[key].status == "refused" and change[0] in rows_of[key].reason for key, change in jobs)
            assert sum(sizes) == len(jobs) and sizes[-1] == 1
            assert sizes[0] == {0.001: 15, 0.3: 3, 2.0: 1}[seconds]


def test_processes_started_apart_one_killed_in_the_middle(tmp_path, processes, reference):
    """A scheduler and two workers; one is killed after the second point. No point is lost, none is there twice, and
    the table is the one of any other run."""
    address, workers = processes

    def progress(done, total):
        if done == 2:
            workers[0].kill()
            workers[0].wait()

    made = bp.sweep(mission(), OVER, tmp_path / "a", scheduler=address, progress=progress)
    assert rows(made) == reference
    assert [row.status for row in made.rows] == ["ok", "ok", "refused"] * 2 + ["refused"] * 3
    assert len(lines(tmp_path / "a")) == len(reference)
    # with the one that is left
    bp.sweep(mission(), OVER, tmp_path / "b", scheduler=address)
    for name in ("table.csv", "table.parquet"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_stopped_by_the_user_it_leaves_a_table_and_goes_on(tmp_path, processes, reference):
    address, _ = processes
    folder = tmp_path / "s"
    seen = []

    def stop(done, total):
        if done == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bp.sweep(mission(), OVER, folder, scheduler=address, progress=stop)
    kept = lines(folder)
    with (folder / "table.csv").open() as file:
        table = list(csv.DictReader(file))
    assert len(table) == len(kept) == 4
    assert "4 of 9 points are finished" in (folder / "report.html").read_text()
    made = bp.sweep(mission(), OVER, folder, scheduler=address, progress=lambda done, total: seen.append(done))
    assert seen == [4, 5, 6, 7, 8, 9] and lines(folder)[:4] == kept
    assert rows(made) == reference
    # nothing is left to do: no workers are asked for
    assert rows(bp.sweep(mission(), OVER, folder, scheduler="tcp://127.0.0.1:1")) == reference


KILLED = """
import os, signal, sys
import bodyplan as bp
sys.path.insert(0, sys.argv[3])
from search_cases import OVER, mission
def progress(done, total):
    if done == 3:
        os.kill(os.getpid(), signal.SIGKILL)
bp.sweep(mission(), OVER, sys.argv[1], scheduler=sys.argv[2], progress=progress)
"""


def test_killed_by_the_system_it_goes_on(tmp_path, processes, reference):
    address, _ = processes
    folder = tmp_path / "s"
    ended = subprocess.run(
        [sys.executable, "-c", KILLED, str(folder), address, str(Path(__file__).parent)], check=False
    )
    assert ended.returncode == -9
    kept = lines(folder)
    assert len(kept) == 3 and not (folder / "table.csv").exists()
    # as if the power had gone in the middle of a line
    with (folder / "points.jsonl").open("ab") as file:
        file.write(b'{"key":"0123","status":"o')
    assert rows(bp.sweep(mission(), OVER, folder, scheduler=address)) == reference
    assert lines(folder)[:3] == kept and len(lines(folder)) == len(reference)


def test_files_of_a_mission_travel_with_it(tmp_path, processes):
    """The worker's folder has no such file: it gets the content."""
    address, _ = processes
    here = tmp_path / "here"
    here.mkdir()
    bp.snake(8, 0.1).to_toml(here / "robot.toml")
    text = MISSION.replace('kind = "snake"\nlinks = 8\nlink_length = "100 mm"', 'kind = "file"\npath = "robot.toml"')
    loaded = mission(text, folder=here)
    (here / "robot.toml").rename(here / "gone.toml")
    with pytest.raises(bp.InputError, match=r"robot\.toml: cannot be read"):
        bp.sweep(loaded, {"gait.omega": [1.0]}, tmp_path / "s", scheduler=address, simulate=False)
    (here / "gone.toml").rename(here / "robot.toml")
    made = bp.sweep(loaded, {"gait.omega": [1.0]}, tmp_path / "s", scheduler=address, simulate=False)
    (point,) = made.points
    assert rows(made) == {point.overrides: alone(point, simulate=False)}


def test_an_optimisation_does_not_depend_on_where_it_was_stopped(tmp_path, processes):
    """Eight trials at once, and four trials, a stop in the middle, then the rest: the same study."""
    address, _ = processes
    asked = {
        "vary": ["gait.omega=0.8:1.6", "ground.width=140 mm:170 mm"],
        "maximise": "trial.speed",
        "subject_to": "trial.peak_torque<=3",
        "batch": 4,
        "scheduler": address,
    }
    whole = bp.optimise(mission(), **asked, trials=8, out=tmp_path / "a")

    def stop(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bp.optimise(mission(), **asked, trials=4, out=tmp_path / "b", progress=stop)
    assert "Stopped: 2 of 4" in (tmp_path / "b" / "report.html").read_text()
    bp.optimise(mission(), **asked, trials=4, out=tmp_path / "b")
    parts = bp.optimise(mission(), **asked, trials=8, out=tmp_path / "b")
    assert (tmp_path / "a" / "table.csv").read_bytes() == (tmp_path / "b" / "table.csv").read_bytes()
    assert [t.number for t in parts.trials] == list(range(8))
    values = np.array([t.row.figures["trial.speed_m_s"] for t in whole.trials if t.row.ok])
    allowed = np.array([t.row.figures["trial.peak_torque_Nm"] <= 3 for t in whole.trials if t.row.ok])
    assert whole.trials[whole.best].row.figures["trial.speed_m_s"] == values[allowed].max()
    best = bp.load_mission(tmp_path / "a" / "best.toml")
    assert best.gait.omega == whole.trials[whole.best].values[0].setting


def test_no_cluster_no_workers_another_version(tmp_path, monkeypatch, processes):
    address, _ = processes
    monkeypatch.setattr(cluster, "PATIENCE", 0.5)
    with pytest.raises(bp.InputError, match="no cluster answers"):
        bp.sweep(mission(), OVER, tmp_path / "s", scheduler="tcp://127.0.0.1:1")
    monkeypatch.setattr(cluster, "PATIENCE", 60.0)
    monkeypatch.setattr(cluster, "__version__", "99.0")
    with pytest.raises(bp.BodyplanError, match=r"a worker runs bodyplan .*, this process 99\.0"):
        bp.sweep(mission(), {"gait.omega": [1.1, 1.2]}, tmp_path / "t", scheduler=address)


def test_two_writers_are_refused(tmp_path):
    pytest.importorskip("fcntl")
    with store_at(tmp_path / "points.jsonl"), pytest.raises(bp.InputError, match="another process"):
        bp.sweep(mission(), OVER, tmp_path, workers=1)
    assert os.listdir(tmp_path)  # noqa: PTH208
