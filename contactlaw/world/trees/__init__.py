"""Kinematic trees in generalised coordinates: kinematics, mass matrix, mobility, free flight and implicit steps."""
