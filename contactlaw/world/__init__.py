"""Bodies move, contacts push: rigid bodies with an elastic-frictional contact law, complete without an engine.

    drift both bodies, look where they are, ask the law, kick both, equal and opposite, at one point

Method. A step of any length is integrated in pieces. Bodies that touch nothing fly: centres of mass on parabolas,
rotations such that energy and angular momentum stay constant to rounding (`bodies.motion`). Bodies joined by closed
contacts form islands, and each island is integrated by a leapfrog, some hundred substeps an impact:

    x <- x + h v + h^2/2 a      v <- v + h a                     drift, of all bodies of an island
    P, F = law(overlap, displacement)                            from the geometry then (`shapes`, `contacts`)
    v <- v + w J/m      L <- L + w r x J      J = P n + F        kick, w half the substeps before and after

Both bodies receive the same impulse at one point, so linear and angular momentum are conserved to rounding whatever the
substeps are. Substeps of one contact keep their length, which keeps the symmetry of the leapfrog and with it the
energy; at both ends of an impact, where the force is a fractional power of time, the sum is corrected (Euler-Maclaurin,
`contacts.leapfrog`). A touch in free flight is found by conservative advancement, and the substeps begin there.

Schedule. A window of time is as long as the shortest impact in it. Whatever is closed, or could close within it, is
integrated in the window; islands are independent of each other and have substeps of their own. Everything else costs
one comparison (`step`, `window`, `island`). An island in which nothing strikes takes one implicit step instead
(`implicit`), and falls asleep once its motion is nothing against what loads it (`sleep`).

Limits. While anything strikes in an island, all its contacts have the substeps of the fastest, so a heap that rattles
costs several times what an engine's own solver does. Overlaps must be small beside the radii (Hertz).

Trees. Bodies held by joints form a kinematic tree, which moves as a whole in the generalised coordinates of MuJoCo:
hinges, slides, balls and free joints. An impulse p at a point of a body changes velocities by M^-1 J^T p (`trees`).
Forces on joints are constant over a step, except damping. Code for trees is called by address and compiled only where
there are some. Elastic impacts of a double pendulum keep its energy to 2e-6 each in the median, 2e-5 at worst.

Its packages import downwards only, as the import contracts of pyproject.toml list them.
"""

from contactlaw.world.world import World

__all__ = ["World"]
