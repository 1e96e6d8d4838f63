"""Gallery of the best robots of each task, as film strips of their policies, or of their motion if not trained."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from aidsr.runs import DesignFolder
from aidsr.runs.trainings import Training
from aidsr.studies.outcomes import DesignRow
from aidsr.studies.planned import planned_seeds, training_folder_of
from aidsr.studies.study import Study

_CARDS = 3
"""Number of designs shown for each task. Our choice: keeps the page small enough for email."""
_MOMENTS, _MOMENT_PX = 4, 220
"""Number of pictures in a strip, and width of each [px]."""


@dataclass(frozen=True)
class Card:
    """One robot of the gallery."""

    url: str
    """Data URL of its film strip."""
    task: str
    what: str
    how_well: str
    motion: Path | None = None
    """Recorded motion of its best episode (see `aidsr.learn.rl.pictures.episode_recordings`); None if not trained."""


def gallery(study: Study, rows: Sequence[DesignRow]) -> tuple[Card, ...]:
    """Return the best stable designs of each task, best first; those without any picture are left out."""
    cells = {(cell.arm, cell.task, cell.number): cell for cell in study.cells}
    cards = []
    for task in dict.fromkeys(row.task for row in rows):
        own = [row for row in rows if row.task == task and row.stable]
        for row in sorted(own, key=_rank, reverse=True)[:_CARDS]:
            cell = cells[row.arm, row.task, row.run]
            run = study.run(cell)
            design = run.design(row.design) if run else None
            trained = _best_policy(design, planned_seeds(study, cell, design)) if design else None
            url = _strip(design, trained) if design else ""
            what = f"{row.family}, {row.arm}, run {row.run}.{row.design}"
            if url:
                cards.append(Card(url, task, what, _how_well(row), trained / "best.npz" if trained else None))
    return tuple(cards)


def _rank(row: DesignRow) -> tuple[bool, float, float]:
    return row.successful, row.episodes_share, row.probe_progress or 0.0


def _how_well(row: DesignRow) -> str:
    if not row.evaluations:
        return "not trained"
    word = "successful" if row.successful else "valid" if row.valid else "not valid"
    return f"{word}, {100 * row.episodes_share:.0f} % of episodes won"


def _best_policy(design: DesignFolder, seeds: Iterable[int]) -> Path | None:
    """Return the training folder of a design's best policy with a recorded motion; None where there is none.

    The folder also has a video if OpenGL was available.
    """
    trainings = (Training(training_folder_of(design, seed)) for seed in seeds)
    found = [
        (verdict.valid, verdict.success_share, training.path)
        for training in trainings
        if (training.path / "best.npz").exists() and (verdict := training.evaluation.read())
    ]
    return max(found, key=lambda each: each[:2])[2] if found else None


def _strip(design: DesignFolder, trained: Path | None) -> str:
    if trained and (film := trained / "best.mp4").exists():
        return f"data:image/jpeg;base64,{base64.b64encode(_moments(film)).decode()}"
    drawn = next((found for it in design.leading_to() if (found := it.motion.read() or it.preview.read())), b"")
    return f"data:image/png;base64,{base64.b64encode(drawn).decode()}" if drawn else ""


def _moments(film: Path) -> bytes:
    """Return `_MOMENTS` frames of a video side by side, evenly spaced over its length, as JPEG."""
    import av
    from PIL import Image

    with av.open(str(film)) as container:
        frames = [frame.to_image() for frame in container.decode(video=0)]
    chosen = [frames[round(k * (len(frames) - 1) / (_MOMENTS - 1))] for k in range(_MOMENTS)]
    height = round(_MOMENT_PX * chosen[0].height / chosen[0].width)
    strip = Image.new("RGB", (_MOMENTS * _MOMENT_PX, height))
    for k, result in enumerate(chosen):
        strip.paste(result.resize((_MOMENT_PX, height)), (k * _MOMENT_PX, 0))
    out = io.BytesIO()
    strip.save(out, "JPEG", quality=82)
    return out.getvalue()
