"""Makes tests/ importable, so that test files can say `from loopback import Loopback`."""

from __future__ import annotations

import os
import tempfile

_SETTINGS = tempfile.TemporaryDirectory(prefix="aidsr-tests-")
os.environ["XDG_CONFIG_HOME"] = _SETTINGS.name
"""The key that marks folders as made here is in the user's settings: tests and their processes get one of their own."""
