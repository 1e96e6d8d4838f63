"""The film of the README is small, moves and repeats."""

from pathlib import Path

from PIL import Image

FILM = Path(__file__).parents[2] / "docs" / "images" / "grasping.webp"


def test_the_film_of_the_readme_is_small_moves_and_repeats() -> None:
    assert f"docs/images/{FILM.name}" in (FILM.parents[2] / "README.md").read_text("utf-8")
    assert FILM.stat().st_size < 500_000
    with Image.open(FILM) as film:
        assert film.info["loop"] == 0
        first = film.convert("RGB").tobytes()
        film.seek(film.n_frames // 2)
        assert film.convert("RGB").tobytes() != first
