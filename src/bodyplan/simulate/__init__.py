"""MuJoCo: robot + ground -> model; Motion -> Trial. Knows nothing of gaits."""

from bodyplan.simulate.friction import Friction
from bodyplan.simulate.model import Physics, build, default_servo
from bodyplan.simulate.run import simulate
from bodyplan.simulate.trial import Lift, Slip, Trial

__all__ = ["Friction", "Lift", "Physics", "Slip", "Trial", "build", "default_servo", "simulate"]
