"""What the tests of searches share: a small mission, its points, a cluster of separate processes."""

import json
import os
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import mission_cases
from bodyplan.missions import parse_mission
from bodyplan.search.payload import payload_of
from bodyplan.search.point import evaluate

#: simulated for less: what a search makes of it is what counts
MISSION = mission_cases.MISSION.replace("settle = 0.2", "settle = 0.1").replace('dt = "2 ms"', 'dt = "4 ms"')
#: at the last value of omega the body does not fit between the walls, the third width is no width
OVER = {"gait.omega": [1.0, 1.4, 40.0], "ground.width": ["150 mm", "160 mm", "-1 mm"]}


def mission(text=MISSION, name="m", folder=None):
    return parse_mission(text, name, f"{name}.toml", folder, ())


def alone(point, simulate=True, text=MISSION):
    """The row of a point worked out in this process: status and figures."""
    row = evaluate(payload_of(mission(text)), point.overrides, simulate)
    return row.status, dict(row.figures)


def poisoned(version, payload, overrides, simulate, bounds=None):
    """What a worker does with a point that ends its process, and with all others."""
    if "gait.omega=1.4" in overrides and 'ground.width="160 mm"' in overrides:
        os.kill(os.getpid(), signal.SIGKILL)
    return evaluate(payload, overrides, simulate, bounds)


def lines(folder):
    """The finished points on disk."""
    return [json.loads(line) for line in (folder / "points.jsonl").read_text().splitlines()[1:]]


@contextmanager
def cluster_of_processes(folder, workers):
    """Address of a scheduler and the processes of its workers, all on the loopback interface."""
    paths = [str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"NUMBA_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(paths)}
    started = []

    def start(*arguments):
        command = [sys.executable, "-m", "dask", *arguments, "--host", "127.0.0.1", "--no-dashboard"]
        process = subprocess.Popen(
            command, env=environment, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        started.append(process)
        return process

    try:
        scheduler = start("scheduler", "--port", "0")
        address = next(
            word for line in scheduler.stderr for word in line.split() if word.startswith("tcp://127.0.0.1:")
        )
        yield address, [start("worker", address, "--nthreads", "1", "--no-nanny") for _ in range(workers)]
    finally:
        for process in started:
            process.kill()
        for process in started:
            process.stderr.close()
            process.wait()
