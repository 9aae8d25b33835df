"""Collision shapes and the narrow phase: overlap, normal and point of contact of any two of them."""
