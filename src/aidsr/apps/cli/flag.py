"""Type of a command-line option without a value."""

from __future__ import annotations

from typing import Annotated

from cyclopts import Parameter

Flag = Annotated[bool, Parameter(negative="", show_default=False)]
"""An option that is off unless it is given; there is no --no-... that turns it off."""
