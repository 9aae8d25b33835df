"""Every jitted function of the package: floats and arrays in, floats and arrays out, nothing checked.

Symbols, the same in every kernel (SI units unless a docstring says *scaled*):

    delta   overlap [m], > 0 in contact              P, F    normal and tangential force [N]
    a       contact radius sqrt(R delta) [m]         E*, G*  effective moduli [Pa]
    k       4/3 E* sqrt(R) [N/m^1.5]                 mu      friction coefficient
    zeta    damping ratio of the normal motion       m       normal effective mass [kg]
    x       distance of a node from the middle of the contact line [m]
    q       tangential traction per length of that line [N/m]

    P = k delta^(3/2) + sqrt(5) zeta sqrt(m k) delta^(1/4) d(delta)/dt, never below 0
    p(x) = E* (delta - x^2/R)      dq = G* ds, |q| <= mu p      (method of dimensionality reduction)
    F = P/P_Hertz times the integral of q

The damper does not touch the elastic contact: it changes the total normal force, and friction carries the same
mobilised share F/(mu P) of it as it would without. So stick and slip, and with them the regimes of the elastic
theory, stay exact at any restitution. (Scaling the caps mu p instead makes every damped contact stick at the first
touch, where the damper's share of P is infinite: gross slip then misses psi_1 - 2 chi (1 + e) by 4 chi zeta^2/psi_1,
0.08 at e = 0.5.)

Forces F and tractions q point along the motion of body A relative to B: the force on A is P n - F.
"""
