"""The live viewer in the browser: play a motion, change its gait, see its verdict and what physics make of it."""

from bodyplan.show.live.session import Session, Source, State
from bodyplan.show.live.viewer import Viewer

__all__ = ["Session", "Source", "State", "Viewer"]
