"""A small mission that several tests run, as its file's text."""

MISSION = """title = "t"
[robot]
kind = "snake"
links = 8
link_length = "100 mm"
[gait]
kind = "concertina"
body_modules = 2
gamma_max = 0.8
contraction = "mirror"
max_joint_rate = 3.0
[ground]
kind = "corridor"
width = 0.16
friction = 0.05
[time]
cycles = 1
dt = "50 ms"
[simulate]
cycles = 1
settle = 0.2
dt = "2 ms"
"""
