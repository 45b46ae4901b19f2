"""A level body over ripples; and where it would be out of reach."""

import numpy as np

import bodyplan as bp

robot = bp.tri_wheel()
ripples = bp.Surface("0.03*sin(3*x)*cos(2*y)")
motion = bp.plan(robot, bp.Carry("line", speed=0.2, height=0.16), ripples, bp.times(0, 6, dt=0.05))
print(bp.check(motion))
for wheel in ("fl", "fr", "r"):
    angle = np.degrees(motion.joint(f"{wheel}.adjust"))
    print(f"{wheel}: {angle.min():.1f} .. {angle.max():.1f} deg")

headings = np.linspace(0.0, 2.0 * np.pi, 73)[:-1]
ramp = bp.Plane(slope=(0.2, 0.0))
reach = bp.gaits.carry.reach(robot, ramp, np.zeros((len(headings), 2)), heading=headings)
print(f"on a ramp of 0.2 a level body is out of reach at {np.mean(reach.lowest > reach.highest):.0%} of all headings")
