"""Makes tests/ importable, so that test files can say `from loopback import Loopback`."""
