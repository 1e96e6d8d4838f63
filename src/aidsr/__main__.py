"""`python -m aidsr` is `aidsr`."""

from aidsr.cli import main

main()
