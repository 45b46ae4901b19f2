"""Joint angles for points that you measured, and how well straight and double joints do."""

import numpy as np

import bodyplan as bp

along = np.linspace(0.0, 1.4, 40)
points = np.column_stack([along, 0.12 * np.sin(5.0 * along), 0.02 * along**2])  # m
curve = bp.Sampled(points)

for name, robot in {
    "30 straight links": bp.snake(30, 1.4 / 30, axes="alternating"),
    "ACM-L2's double joints, scaled": bp.snake(14, 0.1, joint="double", axes="universal", end_link=0.18),
}.items():
    for method in ("paper", "optimal"):
        fit = bp.fit(curve, robot, method=method)
        print(f"{name}, {method}: E_nm {fit.error:.3g}, {1e3 * fit.max_distance:.2f} mm at most, {fit.status}")
