"""Resolved rates: which joint rates move the body and the feet as wanted, and what to do with the freedom left. And
forces of the ground on contacts, within friction cones: :mod:`bodyplan.solve.statics`.

    import bodyplan as bp
    import numpy as np

    robot = bp.silo4()
    q = np.tile(np.radians([0.0, 0.0, -120.0]), 4)
    model = bp.solve.model(robot, q, base=[0.0, 0.0, 0.208, 1.0, 0.0, 0.0, 0.0])
    stance = ["fl", "fr", "hl"]
    known = [f"{leg}.foot.v" for leg in stance] + ["hr.foot.v", "body.x", "body.y", "body.yaw"]
    part = bp.solve.partition(model, known=known, axes="world")             # G X = H Y, by name
    psi = bp.solve.stability.Objective("barrier", height=0.2).at(model, stance)
    rates = bp.solve.resolve(
        part,
        {f"{leg}.foot.v": 0.0 for leg in stance}
        | {"hr.foot.v": [0.06, 0.0, 0.04], "body.x": 0.02, "body.y": 0.0, "body.yaw": 0.0},
        gradient=psi.rho(part), d=0.01, limits=bp.solve.Limits(height=(0.15, 0.25)),
    )
    rates.raise_if_failed()
    print(rates["fl.knee"], rates["body.pitch"], rates.rank, rates.condition, rates.residual, psi.rate(rates))

Paper *legs*, section 4, as corrected: see :func:`partition`, :func:`resolve` and :mod:`bodyplan.solve.stability`.
"""

from bodyplan.solve import stability
from bodyplan.solve.configuration import Model, model
from bodyplan.solve.coordinates import coordinate_jacobian, coordinates_from_pose, pose_from_coordinates
from bodyplan.solve.limits import Limits
from bodyplan.solve.metric import Metric
from bodyplan.solve.partitions import Partition, partition
from bodyplan.solve.rates import Rates
from bodyplan.solve.resolution import resolve
from bodyplan.solve.statics import (
    ContactForces,
    RequiredFriction,
    TorqueInterval,
    contact_forces,
    required_friction,
    torque_interval,
)

__all__ = [
    "ContactForces",
    "Limits",
    "Metric",
    "Model",
    "Partition",
    "Rates",
    "RequiredFriction",
    "TorqueInterval",
    "contact_forces",
    "coordinate_jacobian",
    "coordinates_from_pose",
    "model",
    "partition",
    "pose_from_coordinates",
    "required_friction",
    "resolve",
    "stability",
    "torque_interval",
]
