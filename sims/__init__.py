"""Scenes: small simulations that show the law in an engine, each with a check of its own. `python -m sims`."""
