"""Resources that an agent may read: the MJCF guide of the Coder role, the manual, examples, runs with designs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mcp.server.mcpserver import MCPServer
from mcp.server.mcpserver.exceptions import ResourceError, ResourceNotFoundError

from aidsr.core.documentation import NO_DOCS, docs_pages, docs_title
from aidsr.core.errors import AidsrError
from aidsr.core.formatting import excerpt
from aidsr.core.numbered import is_number
from aidsr.core.storage_errors import storage_problem
from aidsr.core.suggestions import closest_name
from aidsr.examples import examples
from aidsr.runs.library import Library
from aidsr.runs.status import read_status
from aidsr.teams.llm.prompts import render

_MOST_RUNS = 100
"""Maximum number of runs in the list. Our choice: usually the newest runs are of interest."""


def add_resources(server: MCPServer, runs: Path) -> None:
    """Add all resources to a server.

    Args:
        server: The MCP server.
        runs: Folder of the runs.
    """
    library = Library(runs)

    @server.resource("aidsr://mjcf-guide", mime_type="text/markdown")
    def mjcf_guide() -> str:
        """How to write a tendon-driven robot in MJCF, with one complete limb."""
        return render("mjcf_guide")

    @server.resource("aidsr://docs", mime_type="text/markdown")
    def docs() -> str:
        """The pages of the manual: address and title of each."""
        titles = ((name, docs_title(page)) for name, page in docs_pages().items())
        return "\n".join(f"- aidsr://docs/{name}: {title}" for name, title in titles) or NO_DOCS

    @server.resource("aidsr://docs/{page}", mime_type="text/markdown")
    def docs_page(page: str) -> str:
        """One page of the manual, such as aidsr://docs/goals."""
        pages = docs_pages()
        if not pages:
            raise ResourceNotFoundError(NO_DOCS)
        if page not in pages:
            near = closest_name(page, list(pages))
            raise ResourceNotFoundError(
                f'no page "{excerpt(page)}"' + (f' (did you mean "{near}"?)' if near else "") + "; aidsr://docs has all"
            )
        return pages[page].read_text(encoding="utf-8")

    @server.resource("aidsr://examples", mime_type="text/markdown")
    def all_examples() -> str:
        """Environments with goals that `make_task` takes: address and what is to be done."""
        return "\n".join(f"- aidsr://examples/{name}: {each.title}" for name, each in examples().items())

    @server.resource("aidsr://examples/{name}", mime_type="application/json")
    def one_example(name: str) -> str:
        """One example: its `objective`, `environment` and `goal`, as make_task takes them."""
        known = examples()
        if name not in known:
            near = closest_name(name, list(known))
            raise ResourceNotFoundError(
                f'no example "{excerpt(name)}"'
                + (f' (did you mean "{near}"?)' if near else "")
                + "; aidsr://examples has all"
            )
        example = known[name]
        asked = {"objective": example.objective, "environment": example.environment, "goal": example.goal}
        return json.dumps(asked, indent=2)

    @server.resource("aidsr://runs", mime_type="text/markdown")
    def all_runs() -> str:
        """The runs of `aidsr design`, the newest first."""
        with _sentences():
            found = library.runs()
            more = [f"- and {len(found) - _MOST_RUNS} older ones"] if len(found) > _MOST_RUNS else []
            lines = [f"- aidsr://runs/{run.path.name}" for run in found[:_MOST_RUNS]]
        return "\n".join([*lines, *more]) or "none yet"

    @server.resource("aidsr://runs/{run}", mime_type="application/json")
    def one_run(run: str) -> str:
        """The status of a run: each design with its outcome, faults, time and cost."""
        with _sentences():
            return read_status(library.run(run)).model_dump_json(indent=2)

    @server.resource("aidsr://runs/{run}/designs/{number}", mime_type="application/xml")
    def one_design(run: str, number: str) -> str:
        """The scene of an approved design of a run, as MJCF."""
        with _sentences():
            folders = [design for design in library.run(run).designs if is_number(number)]
            scene = next((design.final_scene.path for design in folders if design.number == int(number)), None)
            if scene is None or not scene.is_file():
                raise ResourceNotFoundError(
                    f"{run} has no approved design {excerpt(number)}; aidsr://runs/{run} tells of its designs"
                )
            return scene.read_text(encoding="utf-8")


@contextmanager
def _sentences() -> Iterator[None]:
    """Convert errors in the context into a ResourceError with a message of one sentence."""
    try:
        yield
    except AidsrError as error:
        raise ResourceError(str(error)) from None
    except OSError as error:
        raise ResourceError(storage_problem(error) or "a file of the run cannot be read") from None
