"""Draw the film of the README: a robot designed from an objective in words does its task.

    make film

The film shows the objective's words, then the best held-out episode of the design's newest policy, then the policy's
number of successes.
"""

from __future__ import annotations

import argparse
import io
import textwrap
from pathlib import Path

import numpy as np
from matplotlib.font_manager import findfont
from PIL import Image, ImageDraw, ImageFont

from aidsr.core.artifacts import Concept, Evaluation
from aidsr.render.pictures import filmstrip
from aidsr.render.view import View
from aidsr.runs import Run

_DRAWN = (1040, 1000)
_CROP = (190, 406, 840, 1000)
"""Left, upper, right, lower: the part of a drawn frame that holds robot and object [px]."""
_SIZE = (560, 512)
_VIEW = View(azimuth_deg=115.0, elevation_deg=-20.0, closeness=1.2)
_EVERY = 2
"""Control steps from one frame to the next: 12.5 frames per second at 25 actions per second."""
_WORDS_S, _RESULT_S, _FADE = 2.6, 2.0, 5
_QUALITY = 62
_INK, _PAPER = (20, 28, 40), (255, 255, 255)


def main() -> None:
    """Write the film."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("design", type=Path, help="folder of a design with a trained policy")
    parser.add_argument("film", type=Path, help="WebP file to write")
    arguments = parser.parse_args()
    design: Path = arguments.design
    training = sorted(design.glob("training/[0-9]*"))[-1]
    objective = Run(design.parents[1]).asked().objective
    concept = Concept.model_validate_json(sorted(design.glob("*/concept.json"))[-1].read_text("utf-8"))
    evaluation = Evaluation.model_validate_json((training / "evaluation.json").read_text("utf-8"))
    frames, frame_s = _frames(training / "best.npz")
    won = sum(episode.ended == "succeeded" for episode in evaluation.episodes)
    words = f"“{objective.partition('. ')[0]}.”"
    result = f"Success: {won} of {len(evaluation.episodes)} held-out episodes"
    title = _card(frames[0], words)
    acting = [_caption(frame, f"{concept.name}, designed by the built-in rules") for frame in frames]
    last = _caption(frames[-1], result)
    fade = [Image.blend(last, title, (step + 1) / (_FADE + 1)) for step in range(_FADE)]
    film = [title, *acting, last, *fade]
    ms = round(1000 * frame_s)
    durations = [round(1000 * _WORDS_S), *[ms] * len(acting), round(1000 * _RESULT_S), *[ms] * _FADE]
    film[0].save(
        arguments.film,
        save_all=True,
        append_images=film[1:],
        duration=durations,
        loop=0,
        quality=_QUALITY,
        method=6,
    )
    print(f"{arguments.film}: {len(film)} frames, {arguments.film.stat().st_size / 1000:.0f} kB")  # noqa: T201


def _frames(motion: Path) -> tuple[list[Image.Image], float]:
    """Return the frames of a recorded motion, and the time from one to the next [s]."""
    with np.load(motion) as recorded:
        mjcf, qpos, control_dt_s = str(recorded["mjcf"]), recorded["qpos"], float(recorded["frame_s"])
    count = len(qpos) // _EVERY
    width, height = _DRAWN
    drawn = filmstrip(
        mjcf,
        qpos=qpos,
        frames_per_s=1.0 / control_dt_s,
        count=count,
        width=width,
        height=height,
        view=_VIEW,
    )
    Image.MAX_IMAGE_PIXELS = None  # no limit: the picture is made here, with all frames side by side
    strip = Image.open(io.BytesIO(drawn)).convert("RGB")
    left, upper, right, lower = _CROP
    boxes = [(k * width + left, upper, k * width + right, lower) for k in range(count)]
    return [strip.crop(box).resize(_SIZE, Image.Resampling.LANCZOS) for box in boxes], control_dt_s * _EVERY


def _card(frame: Image.Image, words: str) -> Image.Image:
    """Return a faded frame with the objective's words on it."""
    card = Image.blend(frame, Image.new("RGB", frame.size, _PAPER), 0.72)
    pen = ImageDraw.Draw(card)
    text = textwrap.fill(words, 34)
    pen.multiline_text((_SIZE[0] / 2, _SIZE[1] / 2), text, _INK, _font(25), "mm", spacing=12, align="center")
    return card


def _caption(frame: Image.Image, text: str) -> Image.Image:
    """Return a frame with a line of text at its lower edge."""
    captioned = frame.copy()
    pen = ImageDraw.Draw(captioned)
    pen.rectangle((0, _SIZE[1] - 40, *_SIZE), _INK)
    pen.text((_SIZE[0] / 2, _SIZE[1] - 20), text, _PAPER, _font(17), "mm")
    return captioned


def _font(size: int) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(findfont("DejaVu Sans"), size)


if __name__ == "__main__":
    main()
