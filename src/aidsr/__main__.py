"""`python -m aidsr` is `aidsr`."""

from aidsr.apps.cli import main

main()
