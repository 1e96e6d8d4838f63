"""Entry point of `python -m aidsr`, which is the same as the command `aidsr`."""

from aidsr.apps.cli import main

main()
