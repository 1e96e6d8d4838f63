"""The four roles as language-model agents.

Prompts are Markdown files beside these modules: `ROLE.md` is the system prompt of a role, `ROLE_TASK.md` the prompt of
one job. Change a prompt by editing its file.
"""

from dataclasses import replace

from aidsr.core.model import Model
from aidsr.core.roles import Team
from aidsr.teams.llm.coder import CoderAgent
from aidsr.teams.llm.conversation import Conversation
from aidsr.teams.llm.designer import DesignerAgent
from aidsr.teams.llm.direct import DirectCoder, DirectDesigner
from aidsr.teams.llm.integrator import IntegratorAgent
from aidsr.teams.llm.judge import JudgeAgent, ScenePictures, no_pictures

__all__ = ["CoderAgent", "DesignerAgent", "IntegratorAgent", "JudgeAgent", "direct_team", "no_pictures", "team"]


def team(
    model: Model, *, reasks: int = 2, edits: bool = True, condensed: bool = True, pictures: ScenePictures = no_pictures
) -> Team:
    """Return a team whose four roles are played by one language model.

    Args:
        model: The language model; it is called from several threads when concepts are developed in parallel.
        reasks: How often the model is asked again after an unusable reply before the role gives up.
        edits: Whether the Coder repairs a robot by a patch instead of rewriting it.
        condensed: Whether Designer, Integrator and Judge see the MJCF of a robot in condensed form.
        pictures: Function that returns pictures of a scene for the Judge; no pictures by default.
    """
    conversation = Conversation(model, reasks)
    return Team(
        designer=DesignerAgent(conversation, condensed),
        coder=CoderAgent(conversation, edits),
        integrator=IntegratorAgent(conversation, condensed),
        judge=JudgeAgent(conversation, condensed, pictures),
    )


def direct_team(model: Model, *, reasks: int = 2) -> Team:
    """Return the team of direct prompting: one call writes the robot, without concept, placement or critique.

    A run with direct prompting never calls this team's Integrator and Judge, which are those of `team`.
    """
    full = team(model, reasks=reasks)
    return replace(full, designer=DirectDesigner(), coder=DirectCoder(CoderAgent(Conversation(model, reasks))))
