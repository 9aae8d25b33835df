"""Implicit steps for islands in which contacts last: Newton's method on velocities, and when a step may stand."""
