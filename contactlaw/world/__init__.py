"""Bodies move, contacts push: rigid bodies with an elastic-frictional contact law, complete without an engine.

    drift both bodies, look where they are, ask the law, kick both, equal and opposite, at one point

The method. A step of any length is taken in pieces. Bodies that touch nothing fly: centres of mass in parabolas, and
rotations so that energy and angular momentum stay to rounding (`motion`). Bodies with closed contacts make islands, and
each island is moved by a leapfrog, a hundred substeps an impact:

    x <- x + h v + h^2/2 a      v <- v + h a                     drift, of all bodies of an island
    P, F = law(overlap, displacement)                            at the geometry that there is (`geometry`, `force`)
    v <- v + w J/m      L <- L + w r x J      J = P n + F        kick, w half the substeps before and after (`touch`)

Both bodies get the same impulse at one point, so that linear and angular momentum are kept to rounding whatever the
substeps are. Substeps of one contact keep their length, which keeps the leapfrog's symmetry and with it the energy; at
both ends of an impact, where the force is a broken power of time, the sum is corrected (Euler-Maclaurin, `ends`). A
touch in free flight is found by conservative advancement, and there the substeps begin.

The schedule. A window of time is as long as the shortest impact in it. What is closed, or can close within it, by the
motion that there is or by what impacts can make of it, is stepped in the window; islands are independent of each other
and have substeps of their own. All else costs one comparison (`window`, `island`, `step`).

What holds, by test (`tests/world`), at any step and phase: psi_2 of single impacts to 5e-4 against rings with local
Coulomb friction (1e-4 with 64 nodes and 200 substeps); energy of elastic impacts to 3e-6 each, of tumbling bodies to
1e-5 each; momenta to 1e-14. A body at rest falls asleep and stays still to the bit (`sleep`).

What does not: contacts that last are stepped like impacts until they sleep, so a heap that settles costs several times
what an engine's own solver does; all contacts of an island have the substeps of its fastest;
the overlap must stay small beside the radii (Hertz).

Bodies that joints hold make a tree, which branches as it may and moves as a whole in generalised coordinates, those of
MuJoCo: hinges, slides, balls and free joints. A kick at a point of a body becomes v += M^-1 J^T p, and all its bodies
have new velocities (`trees`). Forces on the joints are constant over a step, but for their damping. What is compiled
for trees is called by address, and only where there are some. Elastic impacts of a double pendulum keep its energy to
2e-6 each in the middle, 2e-5 at worst; what a tree's free base has of momentum stays to 1e-6.

Shapes are round (spheres, capsules), boxes and planes; one of two that meet is round. The side of a capsule is crowned
a little, so that where it is nearest is one point, which moves continuously: forces are then the gradient of an energy
whatever rolls over what (`segments`, `box`). Planes that an engine's narrow phase places before each step stand for all
other surfaces; what they lag behind a curved one is an error of first order in the step. What a step hands to the next
besides motion is a row of numbers (`state`).

Read in this order: `records` (what there is), `motion`, `geometry`, `force`, `touch`, `pace`, `window`, `island`,
`step`, `near` (broad phase), `sleep`, `state`, then `world`, the class; for joints `tree` (descriptions), `tree_rows`
(their records), `tree_kinematics`, `tree_dynamics`, `trees` and `tree_motion`. All state is in plain arrays of records.
"""

from contactlaw.world.world import World

__all__ = ["World"]
