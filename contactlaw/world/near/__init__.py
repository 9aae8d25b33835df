"""The broad phase: which pairs of shapes are near, until when they stay apart, and when they could touch."""
