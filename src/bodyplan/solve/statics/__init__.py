"""Statics of a body on point contacts: forces within friction cones, the friction they need, what torques may be.

    import bodyplan as bp

    points = [[0.6, 0.6, 0.0], [0.6, -0.6, 0.0], [-0.6, 0.0, 0.0]]
    normals = [[0.0, 0.0, 1.0]] * 3
    found = bp.solve.contact_forces(points, normals, com=[0.0, 0.0, 0.15], weight=98.1, mu=0.5).raise_if_failed()
    print(found.forces, found.worst)                                           # 1/4, 1/4 and 1/2 of the weight
    print(float(bp.solve.required_friction(points, normals, [0.0, 0.0, 0.15])))  # 0
    levers = [[[0.1, 0.0, 0.2], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]]
    low, high = bp.solve.torque_interval(points, normals, [0.0, 0.0, 0.15], 98.1, 0.5, levers)

``equilibrium.py`` makes the equations in units of the size of one, ``cones.py`` is what a contact may do, ``conic.py``
the cone programs, ``polish.py`` makes their results exact, ``factor.py`` finds the least friction, ``item.py`` decides
what becomes of one item; ``forces.py``, ``friction.py`` and ``interval.py`` are the faces.
"""

from bodyplan.solve.statics.forces import ContactForces, contact_forces
from bodyplan.solve.statics.friction import RequiredFriction, required_friction
from bodyplan.solve.statics.interval import TorqueInterval, torque_interval

__all__ = [
    "ContactForces",
    "RequiredFriction",
    "TorqueInterval",
    "contact_forces",
    "required_friction",
    "torque_interval",
]
