"""Messages of the player, as bytes: the server forwards them unread, and `frames.js` reads them in the browser.

A message begins with four bytes for its kind. FACTS, STATE, TESTS and TRACKS continue as JSON. A FRAME continues,
everything little-endian, with

    uint32   number of moving shapes, of segments of tendons, of tendons, of controls, of contacts
    float32  time [s], pace [times real time]
    float32  position (3) [m] and rotation matrix (9, by rows) of each moving shape
    float32  tendon id, start (3) [m], end (3) [m], radius [m] of each segment
    float32  tension of each tendon [N]
    float32  command of each control
    float32  point (3) [m] and force on the robot (3) [N] of each contact
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

_KIND = struct.Struct("<I")
_HEADER = struct.Struct("<IIIIIff")


class Kind(IntEnum):
    """Kind of a message."""

    FACTS = 0
    """Data of a model; the viewer redraws it."""
    FRAME = 1
    """The model at one time."""
    STATE = 2
    """What is being played, and what went wrong."""
    TESTS = 3
    """Labels of the validator's tests that can be played."""
    TRACKS = 4
    """Time series of the motion that is played back; empty while the simulation is live."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """What is visible at one time.

    Attributes:
        time_s: Time of the simulation, or in the motion [s].
        pace: Speed of playing [times real time].
        poses: Position [m] and rotation matrix of each moving shape, (n, 12).
        segments: Segments of tendons, see `TendonLines.segments`, (n, 8).
        tension_n: Tension of each tendon, (ntendon,) [N].
        ctrl: Command of each control, (nu,).
        contacts: Point and force on the robot of each contact, (n, 6) [m, N].
    """

    time_s: float
    pace: float
    poses: NDArray[np.float32]
    segments: NDArray[np.float32]
    tension_n: NDArray[np.float64]
    ctrl: NDArray[np.float64]
    contacts: NDArray[np.floating]


def kind_of(message: bytes) -> Kind:
    """Return the kind of a message.

    Raises:
        ValueError: The bytes begin with no known kind.
    """
    return Kind(int.from_bytes(message[: _KIND.size], "little"))


def pack_json(kind: Kind, value: dict[str, Any]) -> bytes:
    """Return a message of a kind other than FRAME."""
    return _KIND.pack(kind) + json.dumps(value, allow_nan=False).encode()


def pack_frame(moment: Snapshot) -> bytes:
    """Return a message of the kind FRAME."""
    counts = (len(moment.poses), len(moment.segments), len(moment.tension_n), len(moment.ctrl), len(moment.contacts))
    arrays = (moment.poses, moment.segments, moment.tension_n, moment.ctrl, moment.contacts)
    header = _KIND.pack(Kind.FRAME) + _HEADER.pack(*counts, moment.time_s, moment.pace)
    return header + b"".join(np.ascontiguousarray(array, "<f4").tobytes() for array in arrays)
