"""One style for all plots: colours of the page in SVG, the same colours on white in PNG."""

from pathlib import Path

from matplotlib.axes import Axes

from aidsr.core import plots


def draw(axes: Axes) -> None:
    axes.plot([0, 1], [0, 1], label="a")
    axes.plot([0, 1], [1, 0], label="b")
    axes.axhline(0.5, color=plots.BAD)
    axes.grid()
    axes.legend()


def test_an_svg_takes_its_colours_from_the_page() -> None:
    svg = plots.svg_plot(draw, (3.0, 2.0), 'force of "a" & b', key="one")
    assert svg.startswith("<svg ")
    assert 'aria-label="force of &quot;a&quot; &amp; b"' in svg
    assert {"var(--curve-1)", "var(--curve-2)", "var(--bad)", "var(--line)", "var(--soft)", "var(--ink)"} <= {
        part for part in svg.replace(";", " ").replace('"', " ").split() if part.startswith("var(--")
    }
    assert not any(colour in svg for colour in (*plots.CURVES, plots.INK, plots.SOFT, plots.BAD))


def test_the_base_page_has_every_colour_of_a_plot_in_light_and_in_dark() -> None:
    style = (Path(plots.__file__).parent / "base.html.j2").read_text(encoding="utf-8")
    for variable in ("--ink", "--soft", "--bad", "--line", *(f"--curve-{n}" for n, _ in enumerate(plots.CURVES, 1))):
        assert style.count(f"{variable}: #") == 2, variable


def test_two_plots_of_one_page_share_no_inner_name() -> None:
    one, other = (plots.svg_plot(draw, (3.0, 2.0), "a", key=key) for key in ("one", "other"))
    clips = [{part.split('"')[0] for part in svg.split('clipPath id="')[1:]} for svg in (one, other)]
    assert clips[0]
    assert not clips[0] & clips[1]


def test_a_png_has_no_colour_that_only_stands_for_one() -> None:
    png = plots.png_plot(lambda figure: draw(figure.add_subplot()), (2.0, 1.0))
    assert png.startswith(b"\x89PNG")
