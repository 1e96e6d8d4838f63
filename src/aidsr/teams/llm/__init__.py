"""The four roles as language-model agents.

Each role's words are Markdown files beside its .py file: `ROLE.md` is what it always is told, `ROLE_TASK.md` what it is
told for one job. Change a prompt by editing its file.
"""

from dataclasses import replace

from aidsr.core.model import Model
from aidsr.core.roles import Team
from aidsr.teams.llm.coder import CoderAgent
from aidsr.teams.llm.conversation import Interview
from aidsr.teams.llm.designer import DesignerAgent
from aidsr.teams.llm.direct import DirectCoder, DirectDesigner
from aidsr.teams.llm.integrator import IntegratorAgent
from aidsr.teams.llm.judge import JudgeAgent, See, blind

__all__ = ["CoderAgent", "DesignerAgent", "IntegratorAgent", "JudgeAgent", "blind", "direct_team", "team"]


def team(model: Model, *, reasks: int = 2, edits: bool = True, condensed: bool = True, see: See = blind) -> Team:
    """Return a team whose four roles are played by one language model.

    Args:
        model: The model; it is asked from several threads when concepts run side by side.
        reasks: How often a reply that cannot be used is asked for again before the role gives up.
        edits: Whether the Coder mends a robot by a patch rather than by writing it anew.
        condensed: Whether Designer, Integrator and Judge see a robot without its repetitions.
        see: What pictures of a scene the Judge is shown; none by default.
    """
    interview = Interview(model, reasks)
    return Team(
        designer=DesignerAgent(interview, condensed),
        coder=CoderAgent(interview, edits),
        integrator=IntegratorAgent(interview, condensed),
        judge=JudgeAgent(interview, condensed, see),
    )


def direct_team(model: Model, *, reasks: int = 2) -> Team:
    """Return the team of direct prompting: one call writes the robot, and nobody thinks, places or judges beside it.

    Its Integrator and Judge are never asked in a run of that method; they are those of `team`.
    """
    full = team(model, reasks=reasks)
    return replace(full, designer=DirectDesigner(), coder=DirectCoder(CoderAgent(Interview(model, reasks))))
