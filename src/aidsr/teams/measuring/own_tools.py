"""Tools that only this team has: `propose` families of bodies, `keep` the best scene, and `finish` with a scene.

The docstrings of these three functions and of `Family` are sent to the model as descriptions.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, TypeAdapter

from aidsr.core.artifacts import Artifact
from aidsr.core.errors import UserError
from aidsr.teams.llm.prompts import render
from aidsr.tools import TOOLS, Result, Tool, Workspace

FEWEST_FAMILIES = 4
"""Minimum number of proposed families. Source: our choice; the first idea for a job was rarely the one that worked."""


class Family(Artifact):
    """One family of bodies."""

    name: Annotated[str, Field(description="Short label, such as arm, claw, worm, starfish.")]
    idea: Annotated[str, Field(description="How such a body does the job, with numbers; at most 60 words.")]


class Chosen(Artifact):
    """A scene that was kept, or with which a session finished."""

    scene: str
    """Name of the scene; empty if the team gave up."""
    why: str
    measured: bool = True
    """Whether the scene was measured again; a scene that was kept when the budget ended may not have been."""
    ended: str = ""
    """Sentence that says why the session ended; empty in a record written by the call of `keep` or `finish`."""


_FAMILIES = TypeAdapter(tuple[Family, ...])
_SCENE = Annotated[str, Field(description='Name of a stable scene, such as "scene_4".')]


def propose(
    workspace: Workspace,
    families: Annotated[tuple[Family, ...], Field(description="Four or more that differ in kind.")],
) -> Result:
    """Say which families of bodies could do the job, before any is written."""
    names = family_names(family.name for family in families)
    if len(names) < FEWEST_FAMILIES:
        raise UserError(f"{len(names)} families; propose at least {FEWEST_FAMILIES} of different names")
    workspace.folder.mkdir(parents=True, exist_ok=True)
    _families_path(workspace).write_bytes(_FAMILIES.dump_json(families, indent=2))
    return Result(text=f"noted: {', '.join(names)}")


def keep(
    workspace: Workspace,
    scene: _SCENE,
    why: Annotated[str, Field(description="The figures that make it the best so far.")],
) -> Result:
    """Note the best scene so far; it is the result if the budget ends before you finish."""
    require_stable(workspace, scene)
    write_chosen(workspace, "kept", Chosen(scene=scene, why=why, measured=False))
    return Result(text=f"kept {scene}")


def finish(
    workspace: Workspace,
    scene: Annotated[str, Field(description="Name of the best scene; empty to give up.")],
    summary: Annotated[str, Field(description="What the body is and how it does the job, with measured figures.")],
) -> Result:
    """End with the best scene, after it was measured again by seeds or variations it was not chosen by."""
    if scene:
        require_stable(workspace, scene)
    write_chosen(workspace, "finished", Chosen(scene=scene, why=summary))
    return Result(text=f"finished with {scene or 'nothing'}")


def _read(workspace: Workspace, *, name: str, **arguments: Any) -> Result:
    """Return the guide to MJCF if `name` is `GUIDE`, else the result of the general tool `read`."""
    if name == GUIDE:
        return Result(text=render("mjcf_guide"))
    return TOOLS["read"].function(workspace, name=name, **arguments)


GUIDE = "guide"
READ = Tool(
    "read",
    f'{TOOLS["read"].description.rstrip(".")}; "{GUIDE}" is the whole guide to MJCF.',
    TOOLS["read"].arguments,
    _read,
)
"""The tool `read`, which here also shows the guide to MJCF: the prompts of this team have the guide only while it
writes its first bodies."""
OWN_TOOLS = {tool.name: tool for tool in (Tool.of(propose), Tool.of(keep), Tool.of(finish))}


def require_stable(workspace: Workspace, scene: str) -> None:
    """Check that a scene exists and is stable.

    Raises:
        UserError: The scene does not exist, or the validator found it unstable.
    """
    if not workspace.record(scene).stable:
        raise UserError(f"{scene} is not stable: cure the faults that assemble found, then assemble it again")


def has_families(workspace: Workspace) -> bool:
    """Whether families were proposed."""
    return _families_path(workspace).is_file()


def proposed_families(workspace: Workspace) -> tuple[Family, ...]:
    """Return the families of the last proposal; empty before the first one."""
    return _FAMILIES.validate_json(_families_path(workspace).read_bytes()) if has_families(workspace) else ()


def family_names(names: Iterable[str]) -> list[str]:
    """Return names of families as they are compared: in lower case, each once."""
    return list(dict.fromkeys(name.strip().lower() for name in names))


def _families_path(workspace: Workspace) -> Path:
    return workspace.folder / "families.json"


def chosen(workspace: Workspace, which: str) -> Chosen | None:
    """Return the scene recorded as `which`, "kept" or "finished"; None if there is none."""
    path = workspace.folder / f"{which}.json"
    return Chosen.model_validate_json(path.read_bytes()) if path.is_file() else None


def write_chosen(workspace: Workspace, which: str, value: Chosen) -> None:
    """Record a scene as `which`, "kept" or "finished"."""
    (workspace.folder / f"{which}.json").write_text(value.model_dump_json(indent=2), encoding="utf-8")
