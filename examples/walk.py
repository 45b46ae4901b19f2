"""A quadruped from a CSV of its D-H parameters walks over hills."""

from pathlib import Path

import bodyplan as bp

robot = bp.silo4()  # your own legs: bp.Robot.from_table("dog.csv", contacts=...)
table = bp.Robot.from_table(Path(__file__).with_name("silo4_legs.csv"))
print(table.joints)

hills = bp.Surface("0.015*sin(6*x)*cos(5*y)")
walk = bp.Crawl(velocity=(0.012, 0.004), yaw_rate=0.01, margin=0.02, foothold="search")
motion = bp.plan(robot, walk, hills, bp.times(0, 12, dt=0.05))
print(bp.check(motion))
print(f"least support margin {1e3 * motion.facts['support_margin']:.1f} mm")
