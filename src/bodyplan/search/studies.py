"""An optimisation: Optuna suggests values of a mission's fields, workers try them, the study keeps what they found.

Points are asked for and told in batches of one size whatever the number of workers, and the sampler is seeded anew for
each of them, so that the study does not depend on the workers, nor on where it was stopped and gone on with.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from bodyplan.errors import InputError, MissingExtraError, UnknownNameError
from bodyplan.search.measures import Bound, Measure
from bodyplan.search.parameters import Range, Value
from bodyplan.search.point import Row

SAMPLERS = ("tpe", "cmaes", "nsga2", "random")
#: violation of a point that has no value to tell how far off it is
WORST = 1e3
#: told instead of a value that does not exist or, to an optimiser without constraints, of one that does not count
PENALTY = 1e9
#: points that NSGA-II breeds from
POPULATION = 24


@dataclass(frozen=True)
class Objective:
    """A measure to make as large as possible, or as small."""

    measure: Measure
    maximise: bool

    @property
    def text(self) -> str:
        """ "highest trial.speed_m_s"."""
        return f"{'highest' if self.maximise else 'lowest'} {self.measure.text}"


@dataclass(frozen=True)
class Trial:
    """A point of a study: its ``number``, the values of its fields, and the row that came of it."""

    number: int
    values: tuple[Value, ...]
    row: Row


def optuna_() -> Any:
    """The library Optuna, or MissingExtraError."""
    try:
        import optuna
    except ImportError as error:
        raise MissingExtraError("optuna", "search", "optimisation") from error
    return optuna


def sampler_named(name: str | None, objectives: Sequence[Objective], ranges: Sequence[Range]) -> str:
    """The sampler of that name, or the default one: TPE, and NSGA-II for several objectives. InputError where it cannot
    do what is asked."""
    if name is None:
        return "tpe" if len(objectives) == 1 else "nsga2"
    if name not in SAMPLERS:
        raise UnknownNameError("sampler", name, SAMPLERS)
    if name == "cmaes":
        if len(objectives) > 1:
            raise InputError("sampler cmaes: has one objective; take nsga2 or tpe for two.")
        words = [one.key for one in ranges if one.choices]
        if words:
            raise InputError(f"sampler cmaes: varies numbers only; {words[0]} has choices: take tpe.")
        try:
            import cmaes  # noqa: F401
        except ImportError as error:
            raise MissingExtraError("cmaes", "search", "the sampler cmaes") from error
    return name


@contextmanager
def quiet() -> Iterator[None]:
    """Optuna says a line a trial otherwise."""
    logging = optuna_().logging
    level = logging.get_verbosity()
    logging.set_verbosity(logging.ERROR)
    try:
        yield
    finally:
        logging.set_verbosity(level)


class Study:
    """Optuna's study with a sampler, a seed and a batch of one size."""

    def __init__(
        self,
        storage: str,
        name: str,
        ranges: Sequence[Range],
        objectives: Sequence[Objective],
        bounds: Sequence[Bound],
        *,
        sampler: str,
        seed: int,
        batch: int,
        start: Mapping[str, Any],
    ) -> None:
        """Open the study ``name`` in the database at the URL ``storage``, or begin it with a point at ``start``."""
        self.ranges, self.objectives, self.bounds = tuple(ranges), tuple(objectives), tuple(bounds)
        self.sampler, self.seed, self.batch = sampler, seed, batch
        optuna = optuna_()
        try:
            self._study = optuna.create_study(
                storage=storage,
                study_name=name,
                load_if_exists=True,
                directions=["maximize" if one.maximise else "minimize" for one in objectives],
            )
        except ImportError as error:
            raise InputError(f"storage {storage!r}: its database driver is not installed ({error}).") from error
        except Exception as error:  # a database says what is wrong in many ways
            if not type(error).__module__.startswith(("sqlalchemy", "optuna", "redis")):
                raise
            raise InputError(f"storage {storage!r}: cannot be opened ({str(error).splitlines()[0]}).") from error
        if start and not self._study.get_trials(deepcopy=False):
            self._study.enqueue_trial(dict(start))

    def trials(self) -> list[Any]:
        """Those of Optuna's trials that have values, by number."""
        states = optuna_().trial.TrialState
        return list(self._study.get_trials(deepcopy=False, states=(states.RUNNING, states.COMPLETE)))

    def told(self) -> int:
        """How many trials are told."""
        return sum(trial.state.name == "COMPLETE" for trial in self.trials())

    def remembered(self, trial: Any) -> Row | None:
        """What the study itself keeps of a trial that is told: status and objectives; None of another one."""
        if trial.state.name != "COMPLETE":
            return None
        return Row(trial.user_attrs["status"], "its other figures are not in this folder", trial.user_attrs["figures"])

    def open_batch(self) -> list[Any]:
        """The trials of the batch under way that are still to be told; new ones are asked for until it is full."""
        full = self.batch * (self.told() // self.batch + 1)
        distributions = {one.key: _distribution(one) for one in self.ranges}
        for number in range(len(self.trials()), full):
            self._study.sampler = self._sampler(number)
            self._study.ask(distributions)
        return [trial for trial in self.trials() if trial.state.name == "RUNNING"]

    def values(self, trial: Any) -> tuple[Value, ...]:
        """The values of the fields at a trial."""
        return tuple(one.value(trial.params[one.key]) for one in self.ranges)

    def tell(self, trial: Any, row: Row) -> None:
        """Tell what came of a trial."""
        live = optuna_().trial.Trial(self._study, trial._trial_id)
        missed = violations(row, self.bounds)
        for name, value in missed.items():
            live.set_constraint(name, value)
        live.set_user_attr("status", row.status)
        live.set_user_attr("figures", {name: row.figures.get(name) for name in self._names()})
        self._study.tell(live, [self._told(one, row, missed) for one in self.objectives])

    def front(self) -> tuple[int, ...]:
        """Numbers of the trials that no other one is better than in every objective, of those that keep all bounds."""
        return tuple(t.number for t in self._study.best_trials if all(v <= 0.0 for v in t.constraints.values()))

    def _names(self) -> list[str]:
        """Figures that objectives and bounds are made of."""
        measures = [*(one.measure for one in self.objectives), *(one.measure for one in self.bounds)]
        return list(dict.fromkeys(name for measure in measures for name in measure.names))

    def _told(self, objective: Objective, row: Row, missed: Mapping[str, float]) -> float:
        worse = -1.0 if objective.maximise else 1.0
        value = objective.measure.of(row.figures)
        excess = sum(max(0.0, v) for v in missed.values())
        if value is None or (self.sampler == "cmaes" and excess > 0.0):
            # CMA-ES knows no constraints but ranks: what keeps them before what does not, by how much
            return worse * PENALTY * (1.0 + excess)
        return value

    def _sampler(self, number: int) -> Any:
        import numpy as np

        samplers = optuna_().samplers
        seed = int(np.random.SeedSequence([self.seed, number]).generate_state(1)[0])
        make: dict[str, Callable[[], Any]] = {
            "tpe": lambda: samplers.TPESampler(seed=seed, n_startup_trials=max(10, self.batch), multivariate=True),
            "cmaes": lambda: samplers.CmaEsSampler(seed=seed, popsize=self.batch),
            "nsga2": lambda: samplers.NSGAIISampler(seed=seed, population_size=POPULATION),
            "random": lambda: samplers.RandomSampler(seed=seed),
        }
        return make[self.sampler]()


def violations(row: Row, bounds: Sequence[Bound]) -> dict[str, float]:
    """By how much a row misses what is demanded, by demand; 0 or less where it is kept. All being well with plan,
    checks and physics is the first demand."""
    well = 0.0 if row.ok else WORST
    if row.status == "check_failed":
        well = row.figures.get("check.failed") or WORST
    out = {"well": well}
    for bound in bounds:
        excess = bound.excess(row.figures)
        out[bound.text] = WORST if excess is None or not math.isfinite(excess) else excess
    return out


def feasible(row: Row, bounds: Sequence[Bound]) -> bool:
    """True where all is well and every bound is kept."""
    return all(value <= 0.0 for value in violations(row, bounds).values())


def _distribution(one: Range) -> Any:
    made = optuna_().distributions
    if one.choices:
        return made.CategoricalDistribution([str(value.shown) for value in one.choices])
    if one.whole:
        return made.IntDistribution(int(one.low), int(one.high), log=one.log)
    return made.FloatDistribution(one.low, one.high, log=one.log)
