"""A snake through a corridor: plan, check, physics."""

import bodyplan as bp

snake = bp.snake(links=26, link_length=0.05, radius=0.015, mass=0.05)
gait = bp.Concertina(body_modules=8, omega=1.2, extension=0.35, waves=2)
corridor = bp.Corridor(width=0.100, height=0.06, friction=0.05, wall_friction=1.0)

motion = bp.plan(snake, gait, corridor, bp.times(0, gait.period(snake), dt=0.02))
report = bp.check(motion)
print(report)
trial = bp.simulate(motion, cycles=1)
print(f"executed / planned {trial.advance_ratio:.2f}, peak torque {trial.peak_torque:.2f} N m")
