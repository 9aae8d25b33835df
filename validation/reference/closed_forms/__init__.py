"""Closed forms of impact theory, one idea a file; they judge the laws and the annulus solver alike.

rigid: impact of rigid bodies with Coulomb friction; regimes: what sticks and slides in the elastic theory; oscillator:
linear springs under a Coulomb cap; hertz: normal impact in SI units; gross_slip: surface displacements while all of a
contact slides; waves: energy radiated into a half-space, lowest mode of a sphere; dundurs: coupling of normal and
tangential tractions between unlike materials.

Scaled quantities are those of the annulus solver: psi = (kappa/mu) V_x/V_z1, chi = (kappa/2) m_N/m_T.
"""
