"""Narrow phase: overlap, normal and point of contact of two shapes, and the effective radius there."""
