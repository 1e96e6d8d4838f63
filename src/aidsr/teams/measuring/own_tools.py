"""The tools that only this team has: it proposes families, keeps the best scene, and finishes with one."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, TypeAdapter

from aidsr.core.artifacts import Artifact
from aidsr.core.errors import UserError
from aidsr.teams.llm.prompts import render
from aidsr.tools import TOOLS, Result, Tool, Workspace

FEWEST_FAMILIES = 4
"""Source: our choice; the first idea for a job was rarely the one that did it."""


class Family(Artifact):
    """One family of bodies."""

    name: Annotated[str, Field(description="Short label, such as arm, claw, worm, starfish.")]
    idea: Annotated[str, Field(description="How such a body does the job, with numbers; at most 60 words.")]


class Chosen(Artifact):
    """A scene that was kept or finished with."""

    scene: str
    """Empty where the team gave up."""
    why: str
    measured: bool = True
    """Whether it was measured again before; what was kept when the budget ended may not have been."""
    ended: str = ""
    """Why the work ended, as a sentence; empty in what was kept or finished with by a call."""


_FAMILIES = TypeAdapter(tuple[Family, ...])
_SCENE = Annotated[str, Field(description='Name of a stable scene, such as "scene_4".')]


def propose(
    workspace: Workspace,
    families: Annotated[tuple[Family, ...], Field(description="Four or more that differ in kind.")],
) -> Result:
    """Say which families of bodies could do the job, before any is written."""
    names = list(dict.fromkeys(family.name.strip().lower() for family in families))
    if len(names) < FEWEST_FAMILIES:
        raise UserError(f"{len(names)} families; propose at least {FEWEST_FAMILIES} of different names")
    workspace.folder.mkdir(parents=True, exist_ok=True)
    (workspace.folder / "families.json").write_bytes(_FAMILIES.dump_json(families, indent=2))
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
    """Show the guide to MJCF, or what `read` shows."""
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
"""The tool of this name, of a team that is told the guide to MJCF only while it writes its first bodies."""
OWN_TOOLS = {tool.name: tool for tool in (Tool.of(propose), Tool.of(keep), Tool.of(finish))}


def require_stable(workspace: Workspace, scene: str) -> None:
    """Refuse a scene that there is not, or that the validator found unstable.

    Raises:
        UserError: It is one.
    """
    if not workspace.record(scene).stable:
        raise UserError(f"{scene} is not stable: cure the faults that assemble found, then assemble it again")


def has_families(workspace: Workspace) -> bool:
    """Whether families were proposed."""
    return (workspace.folder / "families.json").is_file()


def proposed_families(workspace: Workspace) -> list[str]:
    """Return the families that were proposed, in lower case; none before there are any."""
    path = workspace.folder / "families.json"
    families = _FAMILIES.validate_json(path.read_bytes()) if path.is_file() else ()
    return list(dict.fromkeys(family.name.strip().lower() for family in families))


def chosen(workspace: Workspace, which: str) -> Chosen | None:
    """Return the scene that was "kept" or "finished" with; None where none was."""
    path = workspace.folder / f"{which}.json"
    return Chosen.model_validate_json(path.read_bytes()) if path.is_file() else None


def write_chosen(workspace: Workspace, which: str, value: Chosen) -> None:
    """Note a scene as "kept" or "finished" with."""
    (workspace.folder / f"{which}.json").write_text(value.model_dump_json(indent=2), encoding="utf-8")
