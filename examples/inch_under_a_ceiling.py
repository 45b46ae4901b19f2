"""How fast a snake may inch under ceilings of several heights."""

import bodyplan as bp

snake = bp.snake(18, 0.1, axes="alternating", first="pitch", foot_radius=0.003, foot_spread=0.06, mass=0.125)
gait = bp.Rectilinear(anchors=5, schedule="two-phase", lift=0.02)
for ceiling in (0.20, 0.16, 0.12, 0.08):
    tunnel = bp.Profile(floor=0.0, ceiling=ceiling)
    period = gait.period(snake, tunnel)
    motion = bp.plan(snake, gait, tunnel, bp.times(0, period, dt=0.05))
    speed = motion.facts["advance_per_cycle"] / period
    print(
        f"{1e3 * ceiling:.0f} mm: {1e3 * speed:.1f} mm/s, all checks {'pass' if bp.check(motion).ok else 'do NOT pass'}"
    )
