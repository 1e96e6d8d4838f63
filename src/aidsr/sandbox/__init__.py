"""Child processes with resource limits, in which untrusted models are compiled and simulated."""
