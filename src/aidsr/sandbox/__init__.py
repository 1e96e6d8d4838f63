"""Child processes with limits, in which models from outside are compiled and simulated."""
