"""List of all files of a run that other programs may rely on; printed in docs/runs.md and by `aidsr show --layout`."""

from __future__ import annotations

LAYOUT: tuple[tuple[str, str], ...] = (
    ("run.json", "what was asked: objective, task, configuration, seed, versions; never a key"),
    (".origin", "mark that the run was made on this machine; see docs/safety.md"),
    ("brief.json", "input of the team: the objective and the environment as facts"),
    ("environment.xml", "the environment, without a robot"),
    ("goal.toml", "what measures success, where a goal was given"),
    ("starting_robot.xml", "the robot to start from, where one was given"),
    ("events.jsonl", "what happened to the run, in order, with times and errors"),
    ("calls/NNNN_ROLE.json", "the Designer's calls to a language model: question, reply, tokens, price"),
    ("calls/NNNN_ROLE.unusable.json", "calls without a reply, or whose replies could not be used; asked again"),
    ("budget.json", "a budget given when the run was resumed; holds instead of the first"),
    (
        "search.json",
        "what the robots of each generation were worth, for the baseline that searches; rewritten with each",
    ),
    ("concepts.json", "the concepts as the Designer proposed them"),
    ("summary.html", "the page to open first; computed from the other files and rewritten as they come"),
    ("designs/N/events.jsonl", "what happened to design N"),
    ("designs/N/II/concept.json", "the concept; in iteration 01 and wherever it changed"),
    ("designs/N/II/robot.xml", "the robot's MJCF, after automatic fixes; wherever it changed"),
    ("designs/N/II/robot_as_written.xml", "the same as the Coder wrote it, where automatic fixes changed it"),
    ("designs/N/II/repairs.json", "what the automatic fixes changed or left out, by code and without a call"),
    ("designs/N/II/robot.json", "functional part, actuator groups, notes and script of that robot"),
    ("designs/N/II/robot_report.json", "the validator's report on that robot"),
    ("designs/N/II/placement.json", "where the robot stands; wherever it changed"),
    ("designs/N/II/scene.xml", "the MJCF of the robot placed in the environment"),
    ("designs/N/II/scene.json", "placement used and notes of the assembly"),
    ("designs/N/II/scene_report.json", "the validator's report on that scene"),
    ("designs/N/II/preview.png", "a picture of the scene, or of the robot where there is no scene"),
    ("designs/N/II/critique.json", "the Judge's verdict on a stable scene"),
    (
        "designs/N/II/task_report.json",
        "where a stable scene stopped when it was tried on its task, with --task-feedback",
    ),
    (
        "designs/N/II/measured_again.json",
        "the same by other seeds and variations, where several fell short and one of them is kept",
    ),
    ("designs/N/II/motion.png", "moments of a scene that the Judge passed or was shown, while its actuators swing"),
    ("designs/N/II/decision.json", "the person's answer; written by a person, in any way"),
    ("designs/N/II/calls/NNNN_ROLE.json", "the calls of this iteration"),
    ("designs/N/II/calls/NNNN_ROLE.unusable.json", "its calls without a reply, with each attempt"),
    ("designs/N/II/tools/NNNN_TOOL.json", "calls of tools and their results, with --team measuring"),
    ("designs/N/II/work/", "robots, scenes and files that its tools made; see docs/tools.md"),
    ("designs/N/outcome.json", "approved, invalid, quit or out_of_budget, with the reason"),
    ("designs/N/outcome_before_M.json", "an earlier out_of_budget, set aside when a larger budget was given"),
    ("designs/N/final.xml", "the approved scene"),
    ("designs/N/final_robot.xml", "the approved robot alone"),
    ("designs/N/export/", "parts, sheet and verdict for the workshop, where that design was exported; may be replaced"),
    ("designs/N/probe.json", "how far that design gets without learning, where it was probed"),
    ("designs/N/probe.png", "moments of the best motion of that probe"),
    ("designs/N/probe.mp4", "all of it, with --film"),
    ("designs/N/training/NNN/", "a policy of that design, its curve and its verdict, where one was trained"),
    ("designs/N/verified.json", "the validator's report on the final scene, repeated in a study"),
)
"""Path patterns and contents. N and M count from 1, II from 01, NNN from 001, NNNN from 0001; ROLE is a role's name."""


def layout_text() -> str:
    """Return the layout as lines of text, one for each file."""
    width = max(len(pattern) for pattern, _ in LAYOUT)
    return "\n".join(f"{pattern:<{width}}  {content}" for pattern, content in LAYOUT)
