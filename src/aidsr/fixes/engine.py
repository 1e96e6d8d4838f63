"""The function `fix`, which fixes an MJCF text in an isolated process and reports the changes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

from lxml import etree

from aidsr.core.arguments import as_names, check_type
from aidsr.core.artifacts import Fault, Keep, Robot, Scene, ValidationReport
from aidsr.core.errors import IsolationError, MjcfError, UserError
from aidsr.core.suggestions import closest_name
from aidsr.fixes import markup
from aidsr.fixes.keeping import Keeping
from aidsr.fixes.record import EditDocument, Fix, FixResult, Request
from aidsr.fixes.registry import FIXES, ON_DOCUMENT
from aidsr.mjcf.edit import to_text
from aidsr.mjcf.read import Document, check_document, check_safety, parse_document, text_of
from aidsr.sandbox.isolated import isolated

_MOST_NOTES = 3
"""Largest number of notes on one fault code; the rest is only counted. Our choice: people and language models read the
notes."""


def fix(
    mjcf: str | Path | Robot | Scene,
    faults: ValidationReport | Sequence[Fault] | None = None,
    *,
    only: str | Collection[str] | None = None,
    kept_names: str | Collection[str] = (),
    keep: Sequence[Keep] = (),
) -> FixResult:
    """Apply automatic fixes to an MJCF text.

    Without `faults`, all safe fixes are applied: they change only what has a single possible meaning, and leave the
    rest to the author. With `faults`, the first fix that changes something is applied for each fault code, mildest
    first, whether it is safe or not; validate the result to see which faults are left.

    The text is returned unchanged if it cannot be read, or if the isolated process fails.

        fixed = aidsr.fix("robot.xml")
        print(fixed.mjcf, fixed.notes)

    Args:
        mjcf: MJCF text, the path of a file (which is not changed), a robot or a scene.
        faults: A validation report on this text, or faults from one; None to apply safe fixes only.
        only: Name or names of the fixes that may be applied; None for all.
        kept_names: Names that are referred to outside the text, such as a robot's functional part; safe fixes do not
            change them.
        keep: Parts that should not change. A fix that would change one is left out, and a note names both; fixes of
            text that is not well-formed XML are applied all the same, as nothing in it has a value before.

    Raises:
        TypeError: `mjcf` or `faults` has another type.
        UserError: The file cannot be read, or `only` names a fix that does not exist.
        MjcfError: The file is too large.
    """
    text = text_of(mjcf)
    found = _faults_of(faults)
    names = [each.name for each in FIXES] if only is None else _known_fixes(as_names(only))
    try:
        return _fix_text(text, found, names, list(as_names(kept_names)), list(keep))
    except IsolationError:
        return FixResult(mjcf=text, unfixed=_codes(found or ()))


def _faults_of(faults: ValidationReport | Sequence[Fault] | None) -> list[Fault] | None:
    """Return the faults to fix as a list; None for safe fixes only.

    Raises:
        TypeError: `faults` is neither a report nor a sequence of faults.
    """
    if faults is None:
        return None
    if isinstance(faults, ValidationReport):
        return list(faults.faults)
    expected = "faults must be a report or faults of one"
    check_type(faults, Sequence, expected)
    for fault in (faults,) if isinstance(faults, str) else faults:
        check_type(fault, Fault, expected)
    return list(faults)


def _known_fixes(only: Sequence[str]) -> list[str]:
    """Return the names of fixes after checking that they exist.

    Raises:
        UserError: There is no fix with one of the names.
    """
    known = [each.name for each in FIXES]
    for name in only:
        if name not in known:
            near = closest_name(name, known)
            hint = f"did you mean {near}?" if near else f"choose from {', '.join(known)}"
            raise UserError(f"no such fix: {name}; {hint}")
    return list(only)


def leave_as_written(mjcf: str, *, kept_names: Collection[str] = (), keep: Sequence[Keep] = ()) -> FixResult:
    """Return the text unchanged; replaces `fix` where robots should be examined as they were written."""
    del kept_names, keep
    return FixResult(mjcf=mjcf)


@isolated
def _fix_text(
    text: str, faults: list[Fault] | None, only: list[str], kept_names: list[str], keep: list[Keep]
) -> FixResult:
    """Fix a text in an isolated process; `faults` is None for safe fixes only, `only` names the allowed fixes."""
    fixes = [each for each in ON_DOCUMENT if each.name in only]
    try:
        readable, document, notes = _read(text, only)
    except MjcfError as error:
        return FixResult(mjcf=text, unfixed=_codes([*(faults or ()), *error.faults]))
    keeping = Keeping(document.root, keep)
    if faults is not None:
        return _cure(readable, document, fixes, faults, notes, keeping)
    if dangers := check_safety(document):
        return FixResult(mjcf=text, unfixed=_codes(dangers))
    return _apply_safe(readable, document, fixes, frozenset(kept_names), notes, keeping)


def _read(text: str, only: Collection[str]) -> tuple[str, Document, dict[str, list[str]]]:
    """Parse a text, after fixes of its markup if necessary.

    Returns:
        The text that was parsed, its document, and the notes on the applied fixes, by name of the fix.

    Raises:
        MjcfError: The text cannot be parsed even after these fixes.
    """
    notes: dict[str, list[str]] = {}
    try:
        return text, parse_document(text), notes
    except MjcfError as error:
        refused = error
    for each in markup.FIXES:
        if each.name in only:
            text, notes[each.name] = each.apply(text)
            try:
                return text, parse_document(text), notes
            except MjcfError:
                continue
    raise refused


def _apply_safe(
    text: str,
    document: Document,
    fixes: Sequence[Fix[EditDocument]],
    kept_names: frozenset[str],
    notes: Mapping[str, list[str]],
    keeping: Keeping,
) -> FixResult:
    """Apply all safe fixes; comments, layout and line ends are preserved."""
    request = Request(kept_names=kept_names)
    changed = {each.name: keeping.apply(each, request) for each in fixes if each.safe}
    put_aside = document.notes if any(changed.values()) else ()
    if any(changed.values()):
        text = _with_line_ends_of(text, etree.tostring(document.root.getroottree(), encoding="unicode"))
    done = {name: each for name, each in {**notes, **changed}.items() if each}
    return FixResult(
        mjcf=text,
        notes=(*put_aside, *(note for each in done.values() for note in each), *keeping.left_out),
        counts={name: len(each) for name, each in done.items()},
        unfixed=_codes(check_document(document)),
    )


def _with_line_ends_of(original: str, changed: str) -> str:
    """Return a changed text with the line ends of the original, CR LF or LF; the parser makes all of them LF."""
    return changed.replace("\n", "\r\n") if "\r\n" in original else changed


def _cure(
    text: str,
    document: Document,
    fixes: Sequence[Fix[EditDocument]],
    faults: Sequence[Fault],
    notes: Mapping[str, list[str]],
    keeping: Keeping,
) -> FixResult:
    """Apply for each fault code the first fix that changes something; a changed document is indented again."""
    done = {"xml_syntax": dict(notes)} if notes else {}
    for fault in _one_per_code(faults):
        if fault.code not in done:
            done[fault.code] = _cure_one(document, fixes, fault, keeping)
    counts: dict[str, int] = {}
    for by_fix in done.values():
        for name, each in by_fix.items():
            counts[name] = counts.get(name, 0) + len(each)
    return FixResult(
        mjcf=_with_line_ends_of(text, to_text(document.root)) if counts else text,
        notes=(
            *(document.notes if counts else ()),
            *(f"{code}: {_summary(by_fix)}" for code, by_fix in done.items() if by_fix),
            *keeping.left_out,
        ),
        counts=counts,
        unfixed=tuple(code for code, by_fix in done.items() if not by_fix),
    )


def _cure_one(
    document: Document, fixes: Sequence[Fix[EditDocument]], fault: Fault, keeping: Keeping
) -> dict[str, list[str]]:
    """Apply fixes for a fault and return their notes, by name of the fix.

    After the first fix that changes something, more are only applied while `check_document` still finds the fault.
    """
    done: dict[str, list[str]] = {}
    for each in fixes:
        if fault.code in each.cures and (notes := keeping.apply(each, Request(fault))):
            done[each.name] = notes
            if fault.code not in _codes(check_document(document)):
                break
    return done


def _one_per_code(faults: Sequence[Fault]) -> list[Fault]:
    """Return one fault for each code, in order, with the names of all faults of that code."""
    merged: dict[str, Fault] = {}
    for fault in faults:
        before = merged.get(fault.code)
        names = tuple(dict.fromkeys((*(before.names if before else ()), *fault.names)))
        merged[fault.code] = (before or fault).model_copy(update={"names": names})
    return list(merged.values())


def _summary(by_fix: Mapping[str, list[str]]) -> str:
    notes = [note.removesuffix(".") for each in by_fix.values() for note in each]
    more = [f"{len(notes) - _MOST_NOTES} more like it"] if len(notes) > _MOST_NOTES else []
    return "; ".join([*notes[:_MOST_NOTES], *more])


def _codes(faults: Iterable[Fault]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(fault.code for fault in faults))
