"""The law in a URDF that comes with PyBullet: sphere_small.urdf, thrown with backspin onto plane.urdf.

`python -m sims.urdf_example` prints how the point of contact moves after the bounce, by Bullet's contact and the law.
"""

from dataclasses import dataclass

from contactlaw import MATERIALS, ContactPair, rebound

RADIUS, SHAPE = 0.03, 0.4  # of the ball: [m], and its inertia over mass and radius squared, as the file has them
PAIR = ContactPair(MATERIALS["rubber"], MATERIALS["steel"], friction=0.8, restitution=0.9)
DOWN, SPIN = 2.0, 20.0  # [m/s], [rad/s]
STEPS = 24  # of 1/240 s, without gravity: down for six of them, then up again


@dataclass(frozen=True)
class Bounce:
    """Velocity before and after a bounce [m/s].

    Attributes:
        upward: Of the ball.
        along: Of its lowest point, along the floor.
    """

    upward: tuple[float, float]
    along: tuple[float, float]


def throw(law: bool) -> Bounce:
    """Throw the ball; law: whether it touches the floor by the law, or by Bullet's contact of like coefficients."""
    import pybullet as p
    import pybullet_data

    from contactlaw.pybullet_callback import ContactCallback, load_urdf

    client = p.connect(p.DIRECT)
    try:
        p.setAdditionalSearchPath(pybullet_data.getDataPath(), client)
        floor = p.loadURDF("plane.urdf", physicsClientId=client)
        contact, place = ContactCallback(client), [0.0, 0.0, 0.08]
        if law:
            ball = load_urdf(contact, "sphere_small.urdf", [("*", floor, PAIR)], basePosition=place).body
        else:
            ball = p.loadURDF("sphere_small.urdf", place, physicsClientId=client)
            p.changeDynamics(ball, -1, linearDamping=0, angularDamping=0, physicsClientId=client)
            for body in (ball, floor):
                p.changeDynamics(body, -1, lateralFriction=PAIR.friction**0.5, physicsClientId=client)
                p.changeDynamics(body, -1, restitution=PAIR.restitution**0.5, physicsClientId=client)
        p.resetBaseVelocity(ball, [0.0, 0.0, -DOWN], [0.0, SPIN, 0.0], client)
        for _ in range(STEPS):
            if law:
                contact.step()
            else:
                p.stepSimulation(client)
        velocity, spin = p.getBaseVelocity(ball, client)
    finally:
        p.disconnect(client)
    return Bounce((-DOWN, velocity[2]), (-RADIUS * SPIN, velocity[0] - RADIUS * spin[1]))


def expected() -> float:
    """The lowest point's velocity along the floor after the bounce by the closed law of one impact [m/s]."""
    psi, chi = PAIR.psi(-RADIUS * SPIN, DOWN), PAIR.chi(1.0, 1.0 / (1.0 + 1.0 / SHAPE))
    return -RADIUS * SPIN * float(rebound(abs(psi), chi, PAIR.law, PAIR.restitution)) / abs(psi)


def check() -> dict[str, Bounce]:
    """Both bounces; raises AssertionError if the law's is not what the law says, or Bullet's own is too."""
    bounces = {"bullet": throw(law=False), "law": throw(law=True)}
    # Without gravity nothing but the law's own step stands between the two; a hundredth leaves that room enough.
    assert abs(bounces["law"].along[1] - expected()) < 0.01 * RADIUS * SPIN, (bounces["law"], expected())
    assert bounces["law"].along[1] > 0.1 * RADIUS * SPIN, bounces["law"]  # backwards
    assert abs(bounces["bullet"].along[1]) < 0.01 * RADIUS * SPIN, bounces["bullet"]  # stopped
    return bounces


if __name__ == "__main__":
    print(f"{'':8}{'upward: before':>16}{'after':>8}{'along the floor: before':>26}{'after [m/s]':>13}")
    for name, bounce in check().items():
        print(f"{name:8}{bounce.upward[0]:16.3f}{bounce.upward[1]:8.3f}{bounce.along[0]:26.3f}{bounce.along[1]:13.3f}")
    print(f"by the law of one impact: {expected():.3f} m/s along the floor")
