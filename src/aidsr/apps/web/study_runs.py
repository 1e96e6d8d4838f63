"""What a page says of a run that belongs to a study, in place of forms whose results the study would not count."""

from __future__ import annotations

from nicegui import ui

from aidsr.apps.web.addresses import study_address
from aidsr.apps.web.site import Site
from aidsr.apps.web.widgets import box, text
from aidsr.runs import Run


def left_to_study(site: Site, run: Run, sentence: str) -> bool:
    """Return whether a run belongs to a study; if so, show `sentence`, and a link to the study.

    Args:
        site: The site.
        run: The run.
        sentence: What the study decides, as a whole sentence.
    """
    study = site.studies.study_of(run.name)
    if study:
        with box("notice", role="status"), box("row apart"):
            text(f"This run belongs to the study “{study}”. {sentence}")
            ui.link("Open the study", study_address(study))
    return bool(study)
