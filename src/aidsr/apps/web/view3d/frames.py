"""Messages of the player, as bytes: the server passes them on unread, `frames.js` reads them in the browser.

A message begins with four bytes for its kind. FACTS, TESTS and STATE continue as JSON. A FRAME continues, everything
little-endian, with

    uint32   number of shapes that move, of pieces of tendons, of tendons, of controls, of contacts
    float32  time [s], pace [times real time]
    float32  position (3) and rotation matrix (9, by rows) of each shape
    float32  tendon, from (3), to (3), radius of each piece [m]
    float32  tension of each tendon [N]
    float32  each control
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
    """A model; the viewer redraws it."""
    FRAME = 1
    """One moment of it."""
    STATE = 2
    """What is being played, and what went wrong."""
    TESTS = 3
    """Which tests of the validator can be played."""
    TRACKS = 4
    """What is known over time of the motion that is played back; empty while the simulation is live."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """What there is to be seen at one time.

    Attributes:
        time_s: Time of the simulation or in the motion [s].
        pace: Times real time.
        poses: Of each shape that moves, (n, 12) [m].
        segments: Pieces of tendons, (n, 8) [m].
        tension_n: Of each tendon, (ntendon,) [N].
        ctrl: Commands, (nu,).
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
        ValueError: It is none.
    """
    return Kind(int.from_bytes(message[: _KIND.size], "little"))


def pack_json(kind: Kind, value: dict[str, Any]) -> bytes:
    """Return a message other than a frame."""
    return _KIND.pack(kind) + json.dumps(value, allow_nan=False).encode()


def pack_frame(moment: Snapshot) -> bytes:
    """Return a frame."""
    counts = (len(moment.poses), len(moment.segments), len(moment.tension_n), len(moment.ctrl), len(moment.contacts))
    arrays = (moment.poses, moment.segments, moment.tension_n, moment.ctrl, moment.contacts)
    header = _KIND.pack(Kind.FRAME) + _HEADER.pack(*counts, moment.time_s, moment.pace)
    return header + b"".join(np.ascontiguousarray(array, "<f4").tobytes() for array in arrays)
