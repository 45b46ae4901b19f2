"""The live viewer: a session, its scene and its panel on a web server of this machine; a clock that plays."""

from __future__ import annotations

import threading
import webbrowser
from time import monotonic
from typing import Any

from bodyplan.show.live import memory
from bodyplan.show.live import server as web
from bodyplan.show.live.panel import Panel
from bodyplan.show.live.session import Session, Source, State
from bodyplan.show.live.stage import Shown, Stage
from bodyplan.show.live.tracks import Tracks

#: pictures a second, and how often the time is written beside them; pictures while a plan is being made, which they
#: would hold up
RATE, READOUTS, PLANNING_RATE = 30.0, 8.0, 10.0
#: longest step of the clock, s: after a pause of the machine the motion goes on where it was
LONGEST = 0.2


class Viewer:
    """A running viewer; ``url`` is what to open in a browser. :meth:`wait` until ctrl-C, :meth:`stop` ends it."""

    def __init__(self, source: Source, *, port: int | None = None, host: str = web.HOST) -> None:
        """Raises InputError for a busy port or a host that is not this machine, MissingExtraError without viser."""
        self.server: Any = web.start(source.title, port, host)
        self.url = web.address(self.server)
        self.time = 0.0
        self._stopped, self._awake = threading.Event(), threading.Event()
        self._shown_state: State | None = None
        self._drawn: float | None = None
        self._told = 0.0
        self.session = Session(source)
        self.tracks = Tracks(source.motion, source.trial)
        try:
            self.shown = Shown()
            self.stage = Stage(self.server)
            self.panel = Panel(self.server, self.session, self.shown, self._wake)
            self.session.listeners.append(lambda _state: self._awake.set())
            self._take(self.session.state)
        except BaseException:
            self.session.stop()
            web.stop(self.server)
            raise
        memory.hold()
        self._clock = threading.Thread(target=self._run, name="bodyplan clock", daemon=True)
        self._clock.start()

    def open(self) -> Viewer:
        """Open the viewer in the browser."""
        webbrowser.open(self.url)
        return self

    def wait(self) -> None:
        """Wait until :meth:`stop`, or ctrl-C, which stops it."""
        try:
            while not self._stopped.wait(0.5):
                pass
        except KeyboardInterrupt:
            pass
        finally:
            self.stop()

    def stop(self) -> None:
        """End the server and all threads."""
        if self._stopped.is_set():
            return
        self._stopped.set()
        self._awake.set()
        self.session.stop()
        if threading.current_thread() is not self._clock:
            self._clock.join(timeout=2.0)
        web.stop(self.server)
        memory.release()

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def __repr__(self) -> str:
        return f"Viewer({self.session.source.title!r}, {'stopped' if self._stopped.is_set() else self.url})"

    # --- the clock's thread

    def _wake(self) -> None:
        self._drawn = None
        self._awake.set()

    def _run(self) -> None:
        last = monotonic()
        while not self._stopped.is_set():
            self._awake.wait(1.0 / RATE)
            self._awake.clear()
            if self._stopped.is_set():
                return
            now = monotonic()
            step, last = min(now - last, LONGEST), now
            state = self.session.state
            if state is not self._shown_state:
                self._take(state)
            self._move(step)
            if self._drawn != self.time:
                self._drawn = self.time
                self.stage.draw(self.time, self.shown)
                if not self.panel.playing or now - self._told >= 1.0 / READOUTS:
                    self._told = now
                    self.panel.at(self.time, self.tracks.duration, self.tracks.stages(self.time))
            # no faster than the pictures, however often something changes
            rate = PLANNING_RATE if self.session.state.planning else RATE
            self._stopped.wait(max(0.0, 1.0 / rate - (monotonic() - now)))

    def _move(self, step: float) -> None:
        panel, end = self.panel, self.tracks.duration
        wanted, panel.wanted = panel.wanted, None
        if wanted is not None:
            self.time = min(max(wanted, 0.0), end)
        elif panel.playing:
            self.time += step * panel.speed
            if self.time > end:
                if panel.loop:
                    self.time %= end
                else:
                    self.time = end
                    panel.set_playing(False)

    def _take(self, state: State) -> None:
        """Show a state of the session: another motion or trial, or only other words."""
        old, self._shown_state = self._shown_state, state
        if old is None or old.motion is not state.motion or old.trial is not state.trial:
            before = self.tracks.duration if old is not None else 0.0
            self.tracks = Tracks(state.motion, state.trial)
            if before > 0.0 and old is not None and old.trial is None and state.trial is None:
                self.time *= self.tracks.duration / before  # the same part of the motion, whatever its speed
            self.time = min(self.time, self.tracks.duration)
            self.stage.set(self.tracks)
            self._drawn = None
        self.panel.tell(state, self.tracks.duration)
