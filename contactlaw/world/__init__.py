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

Tested (`tests/world`), at any step and phase: psi_2 of single impacts to 5e-4 against rings with local Coulomb friction
(1e-4 with 64 nodes and 200 substeps); energy of elastic impacts to 3e-6 each, of tumbling bodies to 1e-5 each; momenta
to 1e-14.

Limits. While anything strikes in an island, all its contacts have the substeps of the fastest, so a heap that rattles
costs several times what an engine's own solver does. Overlaps must be small beside the radii (Hertz).

Trees. Bodies held by joints form a kinematic tree, which moves as a whole in the generalised coordinates of MuJoCo:
hinges, slides, balls and free joints. An impulse p at a point of a body changes velocities by M^-1 J^T p (`trees`).
Forces on joints are constant over a step, except damping. Code for trees is called by address and compiled only where
there are some. Elastic impacts of a double pendulum keep its energy to 2e-6 each in the median, 2e-5 at worst.

Its packages, lowest first; each imports only from those before it, which the import contracts enforce:

    data        records, access by address, vectors
    bodies      free motion, response to impulses, bounds on motion, prescribed motion
    shapes      narrow phase: overlap, normal and point of contact
    trees       kinematics, mass matrix, mobility and motion of kinematic trees
    contacts    a contact from touch to parting, its law, its ledger, its substeps
    near        broad phase: near pairs, how long they stay apart, times of impact
    implicit    implicit steps of islands of persistent contacts
    window, island, sleep, step, state, world     the sequence, and the class `World`
"""

from contactlaw.world.world import World

__all__ = ["World"]
