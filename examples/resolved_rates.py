"""What the joints do for wanted feet and body, by name; and the freedom that is left."""

import numpy as np

import bodyplan as bp

robot = bp.silo4()
q = np.tile(np.radians([0.0, 0.0, -120.0]), 4)
model = bp.solve.model(robot, q, base=[0.0, 0.0, 0.208, 1.0, 0.0, 0.0, 0.0])
stance = ["fl", "fr", "hl"]
known = [f"{leg}.foot.v" for leg in stance] + ["hr.foot.v", "body.x", "body.y", "body.yaw"]
part = bp.solve.partition(model, known=known, axes="world")
wanted = {f"{leg}.foot.v": 0.0 for leg in stance} | {
    "hr.foot.v": [0.06, 0.0, 0.04],
    "body.x": 0.02,
    "body.y": 0.0,
    "body.yaw": 0.0,
}
rates = bp.solve.resolve(part, wanted)
rates.raise_if_failed()
for joint in robot.joints:
    print(f"{joint:10} {np.degrees(rates[joint]):8.3f} deg/s")
print("rank", rates.rank, "residual", rates.residual)
