"""Rigid bodies: free motion, the response to impulses, bounds on the motion to come, and prescribed motion."""
