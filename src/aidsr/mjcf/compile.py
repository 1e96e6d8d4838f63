"""Compile untrusted MJCF text to a model, or report all of its faults at once.

Compilation runs native code on untrusted numbers: call it in a function decorated with `aidsr.sandbox.isolated`, unless
the text comes from this package.
"""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco

from aidsr.core.artifacts import Fault
from aidsr.core.errors import MjcfError
from aidsr.mjcf.compile_errors import collect_compile_errors
from aidsr.mjcf.elements import elements, load_fault
from aidsr.mjcf.read import Document, check_document, check_safety, parse_document

MOST_CONTACTS = 2_000
"""Largest number of contacts in the reference pose. Our choice: ten times the number in a bin full of objects; solving
20,000 contacts takes minutes or fails."""


@dataclass(frozen=True, eq=False)
class Loaded:
    """A document that MuJoCo accepts."""

    document: Document
    spec: mujoco.MjSpec
    model: mujoco.MjModel
    notes: tuple[str, ...]
    """Text and settings that were ignored, and the warnings of MuJoCo's compiler, one sentence each."""


def compile_mjcf(text: str) -> mujoco.MjModel:
    """Return the compiled model of an MJCF text.

    Raises:
        MjcfError: With every fault of the document.
        MemoryError: MuJoCo could not allocate what the model needs.
    """
    return load_mjcf(text).model


def parse_mjcf(text: str) -> mujoco.MjSpec:
    """Return the MjSpec of an MJCF text, which can be changed and compiled again; checked as in `compile_mjcf`.

    Raises:
        MjcfError: With every fault of the document.
        MemoryError: MuJoCo could not allocate what the model needs.
    """
    return load_mjcf(text).spec


def load_mjcf(text: str) -> Loaded:
    """Return the document, MjSpec and MjModel of an MJCF text.

    Raises:
        MjcfError: With every fault of the document.
        MemoryError: MuJoCo could not allocate what the model needs.
    """
    document = parse_document(text)
    unsafe_faults = check_safety(document)
    faults = unsafe_faults + check_document(document)
    if unsafe_faults:
        raise MjcfError(faults)
    with warnings_as_notes() as warned:
        result = collect_compile_errors(document.root)
    faults += [fault for fault in result.faults if not _reported_already(fault, faults)]
    if result.built is None or faults:
        raise MjcfError(sorted(faults, key=lambda fault: fault.line or 0))
    spec, model = result.built
    _check_contacts(model, document)
    notes = (*document.notes, *_ignored(document), *dict.fromkeys(warned))
    return Loaded(document, spec, model, notes)


def _ignored(document: Document) -> Iterator[str]:
    """Yield a sentence about each setting that has no effect here."""
    if any({"njmax", "nconmax"} & set(size.attrib) for size in elements(document.root, "size")):
        yield "Ignored njmax and nconmax of <size>: MuJoCo reserves memory as it is needed."


def _check_contacts(model: mujoco.MjModel, document: Document) -> None:
    """Refuse a model with more contacts in the reference pose than can be simulated.

    Finding the contacts is fast; solving them is not.

    Raises:
        MjcfError: There are more than `MOST_CONTACTS`.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_flex(model, data)
    mujoco.mj_collision(model, data)
    if data.ncon > MOST_CONTACTS:
        problem = f"{data.ncon:,} contacts in the drawn pose, at most {MOST_CONTACTS:,} can be simulated"
        cure = "move the parts apart, exclude neighbours from contact, or use fewer geoms"
        fault = load_fault("load_error", document.root, problem, cure=cure)
        raise MjcfError([fault.model_copy(update={"measured": float(data.ncon), "limit": float(MOST_CONTACTS)})])


@contextlib.contextmanager
def warnings_as_notes() -> Iterator[list[str]]:
    """Collect MuJoCo's and Python's warnings; MuJoCo would otherwise write its own to MUJOCO_LOG.TXT.

    The list is complete when the context ends.
    """
    before, notes = mujoco.get_mju_user_warning(), list[str]()
    mujoco.set_mju_user_warning(notes.append)
    try:
        with warnings.catch_warnings(record=True) as from_python:
            warnings.simplefilter("always")
            yield notes
        notes.extend(str(warning.message) for warning in from_python)
    finally:
        mujoco.set_mju_user_warning(before)


def _reported_already(fault: Fault, faults: list[Fault]) -> bool:
    """Return whether a fault found by MuJoCo is already among `faults`, which have better messages."""
    return any(
        fault.code == other.code and (fault.line == other.line or not set(fault.names).isdisjoint(other.names))
        for other in faults
    )
