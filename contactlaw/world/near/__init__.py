"""Broad phase: which pairs of shapes are near, how long they stay apart, and when they could touch."""
