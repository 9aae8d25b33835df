"""`python -m sims`."""

from contactlaw.ending import run
from sims.cli import app

run(app)
