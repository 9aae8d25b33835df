"""Contacts inside the step of an engine: floats and arrays in, floats and arrays out, nothing checked.

Symbols, the same in every kernel and law (SI units unless a docstring says *scaled*):

    delta   overlap [m], > 0 in contact              P, F    normal and tangential force [N]
    a       contact radius sqrt(R delta) [m]         E*, G*  effective moduli [Pa]
    k       4/3 E* sqrt(R) [N/m^1.5]                 mu      friction coefficient
    zeta    damping ratio of the normal motion       m       normal effective mass [kg]
    x       distance of a node from the middle of the contact line [m]
    q       tangential traction per length of that line [N/m]

Forces F and tractions q point along the motion of body A relative to B: the force on A is P n - F. What the force of a
contact is, the laws say (`contactlaw.laws`); here is when and where it acts.
"""
