"""Every page is whole: no value missing, and what is put in is escaped."""

from pathlib import Path

import pytest
from jinja2 import UndefinedError

from aidsr.core.html import html_template


def page(folder: Path, text: str) -> Path:
    file = folder / "page.html.j2"
    file.write_text('{% extends "base.html.j2" %}\n{% block body %}' + text + "{% endblock %}")
    return file


def test_a_page_extends_the_base_and_escapes_what_is_put_in(tmp_path: Path) -> None:
    drawn = html_template(page(tmp_path, "{{ name | loud }}"), loud=str.upper).render(name="<b>")
    assert "&lt;B&gt;" in drawn
    assert drawn.startswith("<!doctype html>")
    assert "--ground" in drawn, "the palette of all pages"


def test_a_missing_value_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(UndefinedError):
        html_template(page(tmp_path, "{{ name }}")).render()
