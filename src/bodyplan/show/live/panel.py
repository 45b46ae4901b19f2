"""The viewer's controls: play, scrub, sliders of the gait, physics, what to show, downloads."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bodyplan.errors import BodyplanError
from bodyplan.export import FORMATS
from bodyplan.show.live import telling
from bodyplan.show.live.parameters import Key, Parameter, Value
from bodyplan.show.live.session import Session, State
from bodyplan.show.live.stage import Shown

SPEEDS = ("0.1×", "0.25×", "0.5×", "1×", "2×", "4×", "8×")
REPORT = "report (.html)"
BESIDE, OVER = "side by side", "over the plan"
#: part of the panel's text that a label of a slider takes
WIDTH = "large"


class Panel:
    """Controls in viser's panel. ``wake``: called when something was changed by hand."""

    def __init__(self, server: Any, session: Session, shown: Shown, wake: Callable[[], None]) -> None:
        self.session, self.shown, self._wake = session, shown, wake
        self.playing, self.loop, self.speed = True, True, 1.0
        #: a time that the user has asked for, s
        self.wanted: float | None = None
        self._values: dict[Key, Value] = {}
        self._resetting = False
        self._lock = threading.Lock()
        gui = server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width=WIDTH, brand_color=(0, 114, 178))
        self._verdict = gui.add_html("")
        self._play_part(gui)
        self._gait_part(gui)
        self._physics_part(gui)
        self._show_part(gui)
        self._export_part(gui)

    # --- parts

    def _play_part(self, gui: Any) -> None:
        with gui.add_folder("Play"):
            self._play = gui.add_button("Pause", icon="player-pause")
            self._time = gui.add_slider("time (s)", min=0.0, max=1.0, step=0.01, initial_value=0.0)
            self._moment = gui.add_html("")
            speed = gui.add_dropdown("speed", SPEEDS, initial_value="1×")
            loop = gui.add_checkbox("loop", initial_value=True)

        def pressed(_event: Any) -> None:
            self.set_playing(not self.playing)
            self._wake()

        self._play.on_click(pressed)

        def scrubbed(event: Any) -> None:
            if event.client_id is not None:  # moved by hand, not by the clock
                self.set_playing(False)
                self.wanted = float(self._time.value)
                self._wake()

        self._time.on_update(scrubbed)

        def sped(_event: Any) -> None:
            self.speed = float(speed.value.rstrip("×"))

        speed.on_update(sped)

        def looped(_event: Any) -> None:
            self.loop = bool(loop.value)

        loop.on_update(looped)

    def _gait_part(self, gui: Any) -> None:
        self._sliders: list[tuple[Parameter, Any]] = []
        self._others: list[tuple[Any, Any]] = []
        if not self.session.parameters and not self.session.choices:
            return
        with gui.add_folder("Gait"):
            for parameter in self.session.parameters:
                number = int if parameter.whole else float
                slider = gui.add_slider(
                    parameter.label,
                    min=number(parameter.low),
                    max=number(parameter.high),
                    step=number(parameter.step),
                    initial_value=number(parameter.value),
                )
                self._sliders.append((parameter, slider))
                slider.on_update(self._moved(parameter.key, slider, parameter.si))
            for choice in self.session.choices:
                if choice.options:
                    made = gui.add_dropdown(choice.label, choice.options, initial_value=str(choice.value))
                else:
                    made = gui.add_checkbox(choice.label, initial_value=bool(choice.value))
                self._others.append((choice, made))
                made.on_update(self._moved(choice.key, made, lambda value: value))
            reset = gui.add_button("As it was", icon="arrow-back-up")

        def back(_event: Any) -> None:
            with self._lock:
                self._values.clear()
            self._resetting = True
            for item, control in [*self._sliders, *self._others]:
                control.value = item.value
            self._resetting = False
            self.session.change({})

        reset.on_click(back)

    def _moved(self, key: Key, control: Any, si: Callable[[Any], Value]) -> Callable[[Any], None]:
        def moved(_event: Any) -> None:
            if self._resetting:
                return
            with self._lock:  # the latest value, whatever the order in which threads get here
                self._values[key] = si(control.value)
                values = dict(self._values)
                self.session.change(values)

        return moved

    def _physics_part(self, gui: Any) -> None:
        self._run = None
        if self.session.source.simulate is None and self.session.source.trial is None:
            return
        with gui.add_folder("Physics"):
            self._physics = gui.add_html("")
            if self.session.source.simulate is not None:
                self._run = gui.add_button("Run physics", icon="atom")
                self._run.on_click(self._toggle_physics)
            place = gui.add_dropdown("executed", (OVER, BESIDE), initial_value=OVER)

        def placed(_event: Any) -> None:
            self.shown.beside = place.value == BESIDE
            self._wake()

        place.on_update(placed)

    def _toggle_physics(self, _event: Any) -> None:
        state = self.session.state
        if state.physics is not None or state.physics_waits:
            self.session.cancel_physics()
        else:
            self.session.run_physics()

    def _show_part(self, gui: Any) -> None:
        motion = self.session.source.motion
        kinds = {claim.kind for claim in motion.claims}
        there = {
            "plan": ("planned robot", self._run is not None or self.session.source.trial is not None),
            "curve": ("body curve", bool(kinds & {"on_curve", "follows"})),
            "footholds": ("footholds and contacts", motion.contacts is not None),
            "forces": ("contact forces", motion.forces is not None),
            "trail": ("trail of the body", True),
            "ceiling": ("ceiling", True),
            "follow": ("follow the robot", True),
        }
        solids = motion.ground.solids(motion.base[:, :3].min(axis=0) - 1.0, motion.base[:, :3].max(axis=0) + 1.0)
        there["ceiling"] = ("ceiling", any(solid.role == "ceiling" for solid in solids))
        with gui.add_folder("Show", expand_by_default=False):
            for name, (label, useful) in there.items():
                if useful:
                    box = gui.add_checkbox(label, initial_value=bool(getattr(self.shown, name)))
                    box.on_update(self._switched(name, box))

    def _switched(self, name: str, box: Any) -> Callable[[Any], None]:
        def switched(_event: Any) -> None:
            setattr(self.shown, name, bool(box.value))
            self._wake()

        return switched

    def _export_part(self, gui: Any) -> None:
        formats = [suffix.lstrip(".") for suffix in FORMATS]
        if self.session.source.outcome is not None:
            formats.append(REPORT)
        with gui.add_folder("Download", expand_by_default=False):
            chosen = gui.add_dropdown("format", tuple(formats), initial_value=formats[0])
            button = gui.add_button("Download", icon="download")
            said = gui.add_html("")

        def asked(event: Any) -> None:
            if event.client is None:
                return
            button.disabled, said.content = True, ""
            try:
                name, content = export(self.session, chosen.value)
                event.client.send_file_download(name, content, save_immediately=True)
            except BodyplanError as error:
                said.content = telling.trouble(str(error))
            finally:
                button.disabled = False

        button.on_click(asked)

    # --- what the clock and the session say

    def set_playing(self, playing: bool) -> None:
        """Play or stand still."""
        self.playing = playing
        self._play.label, self._play.icon = ("Pause", "player-pause") if playing else ("Play", "player-play")

    def tell(self, state: State, duration: float) -> None:
        """Show a state of the session."""
        self._verdict.content = telling.verdict(state)
        if self._time.max != duration:
            if self._time.value > duration:
                self._time.value = duration
            self._time.max = duration
        if hasattr(self, "_physics"):
            self._physics.content = telling.physics(state)
        if self._run is not None:
            asked = state.physics is not None or state.physics_waits
            self._run.label = "Stop physics" if asked else "Run physics"

    def at(self, time: float, duration: float, stages: list[str]) -> None:
        """Show a time."""
        self._time.value = min(round(time, 2), self._time.max)
        self._moment.content = telling.moment(time, duration, stages)


def export(session: Session, what: str) -> tuple[str, bytes]:
    """Name and content of a file of the motion at hand: one of the formats of ``bodyplan.export`` without its dot, or
    :data:`REPORT`. Raises InputError, UnknownNameError, MissingExtraError."""
    state, name = session.state, session.source.name
    with tempfile.TemporaryDirectory() as folder:
        if what == REPORT:
            from bodyplan.show.report import write_page

            path = write_page(session.outcome(), Path(folder) / f"{name}.html")
        else:
            path = state.motion.save(Path(folder) / f"{name}.{what}")
        return path.name, path.read_bytes()
