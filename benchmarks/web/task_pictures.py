"""Draw the picture of every task as on its card in the web app, for the docs.

python -m benchmarks.web.task_pictures docs/images/tasks
"""

from __future__ import annotations

import argparse
import io
from pathlib import Path

from PIL import Image

from aidsr.render.pictures import picture
from aidsr.render.view import View
from aidsr.tasks import load_task, task_names


def main() -> None:
    """Draw the pictures and write them to a folder."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("folder", type=Path)
    folder: Path = arguments.parse_args().folder
    for name in task_names():
        drawn = picture(load_task(name).environment, width=480, height=360, view=View(authored=True))
        few_colours = Image.open(io.BytesIO(drawn)).convert("RGB").quantize(256, method=Image.Quantize.MAXCOVERAGE)
        few_colours.save(folder / f"{name.rpartition('/')[2]}.png", optimize=True)


if __name__ == "__main__":
    main()
