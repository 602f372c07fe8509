"""The PyBullet world: two compounds of convex teeth, each on a revolute link of a fixed base.

Inside this file and :mod:`gears3d.engine.world` lengths are mm (mass kg, time s), because Bullet's distance
algorithm loses micrometres when gears are given in metres; poses, speeds and torques of the interface are in SI.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.engine.bullet import pybullet
from gears3d.errors import EngineError
from gears3d.files import PRIVATE, temporary

# Bullet's hull computer truncates vertices to this fraction of a piece's extent, towards its middle, on each axis.
QUANTA = 10216
MM = 1e3  # mm per m
TORQUE = 1e6  # kg mm²/s² per N·m, and kg mm² per kg m²
MARGIN = 1e-3  # Bullet's collision margin of a convex hull, in its own length unit: mm here
LINK = 0
GRID = 2.0**-24  # of coordinates in files, in Bullet's length unit: far below the resolution of its numbers of 4 bytes
VERTEX, FACE = "v %d %d %d\n", "f -3 -2 -1\n"
CORNERS = 3 * VERTEX + FACE


def against_truncation(points: np.ndarray) -> np.ndarray:
    """Return the vertices (..., n, 3) of convex pieces moved outwards by half a step of Bullet's grid.

    Truncation then rounds them.

    >>> import numpy as np
    >>> against_truncation(np.array([[0.0, 0.0, 0.0], [1.0216, 1.0216, 1.0216]]))[:, 0].round(9).tolist()
    [-5e-05, 1.02165]
    """
    low, high = points.min(axis=-2, keepdims=True), points.max(axis=-2, keepdims=True)
    return points + 0.5 * (high - low) / QUANTA * np.sign(points - 0.5 * (low + high))


def write_compound(path: Path, pieces: np.ndarray) -> None:
    """Write an OBJ with one object for each convex piece, (pieces, n, 3), which Bullet loads as a compound of hulls.

    Coordinates are whole numbers of ``GRID``, which are written and read faster than decimal fractions.
    """
    # only points of a face are loaded, once for each face; the hull is computed from them
    faces, rest = divmod(pieces.shape[1], 3)
    form = CORNERS * faces + (VERTEX * rest + FACE if rest else "")
    numbers = np.rint(against_truncation(pieces) / GRID).astype(np.int64).reshape(len(pieces), -1)
    text = [f"o piece{i}\n" + form % tuple(piece) for i, piece in enumerate(numbers.tolist())]
    path.write_text("".join(text), encoding="ascii")


@dataclass(frozen=True)
class Body:
    """One gear for Bullet.

    Args:
        pieces: convex pieces in the gear's own frame, (pieces, n, 3) [m].
        centre: of its axis in the world [m].
        inertia: about its axis [kg m²].
        sense: +1 when its positive rotation is counterclockwise seen from +z, else -1.
        lean: of its axis, x and y for a unit of height.
    """

    pieces: np.ndarray
    centre: tuple[float, float, float]
    inertia: float
    sense: int
    lean: tuple[float, float] = (0.0, 0.0)

    @property
    def orientation(self) -> tuple[float, float, float, float]:
        """Quaternion x, y, z, w that turns +z onto its axis.

        >>> Body(np.zeros((0, 4, 3)), (0.0, 0.0, 0.0), 1.0, 1, (0.0, 1.0)).orientation[0] == -math.sin(math.pi / 8)
        True
        """
        steep = math.hypot(*self.lean)
        if steep == 0.0:
            return 0.0, 0.0, 0.0, 1.0
        half = 0.5 * math.atan(steep)
        size = math.sin(half) / steep
        return -self.lean[1] * size, self.lean[0] * size, 0.0, math.cos(half)


KEPT = 2  # worlds that are kept for further runs of the same gears


class World:
    """Two gears in a Bullet world of their own, with the settings that make its impacts exact.

    Args:
        drive: the gear whose motion is imposed.
        loose: the gear that is free to turn.
        respond: whether Bullet's own contact response acts between the two.

    Raises:
        EngineError: a setting did not arrive in Bullet.
    """

    def __init__(self, drive: Body, loose: Body, respond: bool) -> None:
        self._bodies = (drive, loose)
        self._client: int = pybullet.connect(pybullet.DIRECT)
        try:
            self._set_world()
            with temporary(tempfile.gettempdir(), PRIVATE) as folder:
                self._ids = tuple(
                    self._add(body, folder / f"{name}.obj") for name, body in (("drive", drive), ("loose", loose))
                )
            pybullet.setCollisionFilterPair(*self._ids, LINK, LINK, int(respond), physicsClientId=self._client)
            self._check()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Release the Bullet server; closing twice is allowed."""
        if self._client >= 0:
            pybullet.disconnect(physicsClientId=self._client)
            self._client = -1

    def __enter__(self) -> World:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def place(self, theta: tuple[float, float], omega: tuple[float, float]) -> None:
        """Put both gears at their angles [rad] and speeds [rad/s], each in its own sense."""
        for body, ident, angle, speed in zip(self._bodies, self._ids, theta, omega, strict=True):
            pybullet.resetJointState(ident, LINK, body.sense * angle, body.sense * speed, self._client)

    def place_drive(self, theta: float, omega: float) -> None:
        """Impose the drive gear's angle [rad] and speed [rad/s]."""
        sense = self._bodies[0].sense
        pybullet.resetJointState(self._ids[0], LINK, sense * theta, sense * omega, self._client)

    def step(self, duration: float, torque: float) -> tuple[float, float]:
        """Integrate one step [s] in Bullet and return the loose gear's angle [rad] and speed [rad/s].

        ``torque`` on the loose gear is in N m. All are positive in the loose gear's own sense.
        """
        sense = self._bodies[1].sense
        loose = self._ids[1]
        pybullet.setPhysicsEngineParameter(fixedTimeStep=duration, physicsClientId=self._client)
        pybullet.setJointMotorControl2(
            loose, LINK, pybullet.TORQUE_CONTROL, force=sense * torque * TORQUE, physicsClientId=self._client
        )
        pybullet.stepSimulation(self._client)
        state = pybullet.getJointState(loose, LINK, self._client)
        return sense * state[0], sense * state[1]

    def nearest(self, reach: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return Bullet's closest points of all pieces nearer than ``reach`` [m].

        They are points on the drive gear (n, 3) and on the loose gear (n, 3) in the world [m], and the distance of each
        two hulls (n,) [m] as Bullet reports it, margins included.
        """
        found = pybullet.getClosestPoints(*self._ids, reach * MM, LINK, LINK, physicsClientId=self._client)
        if not found:
            return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)
        table = np.array([(*point[5], *point[6], point[8]) for point in found]) / MM
        return table[:, :3], table[:, 3:6], table[:, 6]

    def touching(self) -> float:
        """Return the summed normal force of Bullet's own contacts in the last step [N]."""
        found = pybullet.getContactPoints(*self._ids, LINK, LINK, physicsClientId=self._client)
        return sum(point[9] for point in found) / MM

    def _set_world(self) -> None:
        pybullet.setPhysicsEngineParameter(
            contactSlop=0.0,
            contactERP=0.0,
            erp=0.0,
            frictionERP=0.0,
            restitutionVelocityThreshold=0.0,
            contactBreakingThreshold=1e-4,
            solverResidualThreshold=0.0,
            warmStartingFactor=0.0,
            deterministicOverlappingPairs=1,
            numSubSteps=0,
            physicsClientId=self._client,
        )
        pybullet.setGravity(0.0, 0.0, 0.0, physicsClientId=self._client)

    def _add(self, body: Body, path: Path) -> int:
        """Load one gear as a compound of hulls on a revolute link; return its id."""
        write_compound(path, body.pieces * MM)
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_MESH, fileName=str(path), meshScale=[GRID] * 3, physicsClientId=self._client
        )
        # without a shape to draw, Bullet's renderer would load the hulls again
        drawn = pybullet.createVisualShape(pybullet.GEOM_BOX, halfExtents=[1.0] * 3, physicsClientId=self._client)
        ident = pybullet.createMultiBody(
            baseMass=0.0,
            basePosition=[MM * x for x in body.centre],
            baseOrientation=body.orientation,
            linkMasses=[1.0],
            linkCollisionShapeIndices=[shape],
            linkVisualShapeIndices=[drawn],
            linkPositions=[[0.0, 0.0, 0.0]],
            linkOrientations=[[0.0, 0.0, 0.0, 1.0]],
            linkInertialFramePositions=[[0.0, 0.0, 0.0]],
            linkInertialFrameOrientations=[[0.0, 0.0, 0.0, 1.0]],
            linkParentIndices=[0],
            linkJointTypes=[pybullet.JOINT_REVOLUTE],
            linkJointAxis=[[0.0, 0.0, 1.0]],
            physicsClientId=self._client,
        )
        # maxJointVelocity is set alone and on the base: set with a link it applies the whole call to the base
        pybullet.changeDynamics(ident, -1, maxJointVelocity=1e9, physicsClientId=self._client)
        pybullet.changeDynamics(ident, -1, linearDamping=0.0, angularDamping=0.0, physicsClientId=self._client)
        moment = body.inertia * TORQUE
        pybullet.changeDynamics(
            ident,
            LINK,
            localInertiaDiagonal=[moment, moment, moment],
            restitution=1.0,
            lateralFriction=0.0,
            spinningFriction=0.0,
            rollingFriction=0.0,
            linearDamping=0.0,
            angularDamping=0.0,
            jointDamping=0.0,
            contactProcessingThreshold=0.0,
            physicsClientId=self._client,
        )
        pybullet.setJointMotorControl2(ident, LINK, pybullet.VELOCITY_CONTROL, force=0.0, physicsClientId=self._client)
        return ident

    def restitution(self, value: float) -> None:
        """Set the restitution that Bullet's own contact realises (the other gear keeps 1)."""
        pybullet.changeDynamics(self._ids[1], LINK, restitution=value, physicsClientId=self._client)

    def _check(self) -> None:
        """Read the settings back and refuse to run on others."""
        world: dict[str, Any] = pybullet.getPhysicsEngineParameters(self._client)
        quiet = ("numSubSteps", "gravityAccelerationX", "gravityAccelerationY", "gravityAccelerationZ")
        wrong = [f"{key} = {world[key]}" for key in quiet if world[key] != 0]
        for name, ident, body in zip(("drive", "loose"), self._ids, self._bodies, strict=True):
            link = pybullet.getDynamicsInfo(ident, LINK, physicsClientId=self._client)
            if not math.isclose(link[2][2], body.inertia * TORQUE, rel_tol=1e-12):
                wrong.append(f"inertia of the {name} gear = {link[2][2] / TORQUE} kg m²")
            if link[5] != 1.0 or link[1] != 0.0:
                wrong.append(f"restitution, friction of the {name} gear = {link[5]}, {link[1]}")
            joint = pybullet.getJointInfo(ident, LINK, self._client)
            if joint[6] != 0.0 or joint[7] != 0.0:
                wrong.append(f"damping, friction of the {name} gear's joint = {joint[6]}, {joint[7]}")
        if wrong:
            raise EngineError("Bullet did not take these settings: " + "; ".join(wrong))


# Worlds that no run uses, by the identity of their bodies, the last used last.
_idle: dict[tuple[int, int], World] = {}


@contextmanager
def lent_world(bodies: tuple[Body, Body], respond: bool) -> Iterator[World]:
    """Lend a world of two gears; without contact response it is kept for the next run of the same bodies.

    ``respond`` switches Bullet's own contact response, which changes a world; poses and queries do not.
    """
    key = (id(bodies[0]), id(bodies[1]))
    kept = None if respond else _idle.pop(key, None)
    world = World(*bodies, respond) if kept is None else kept
    try:
        yield world
    finally:
        if respond or key in _idle:
            world.close()
        else:
            _idle[key] = world
        while len(_idle) > KEPT:
            _idle.pop(next(iter(_idle))).close()
