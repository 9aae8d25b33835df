"""`python -m sims`."""

from sims.cli import app
from sims.ending import run

run(app)
