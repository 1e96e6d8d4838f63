"""All pages of the site."""

from __future__ import annotations

from aidsr.apps.web.activities_page import add_activities_page
from aidsr.apps.web.compare_page import add_compare_page
from aidsr.apps.web.design_page import add_design_page
from aidsr.apps.web.designs_page import add_designs_page
from aidsr.apps.web.docs_page import add_docs
from aidsr.apps.web.export_page import add_export_page
from aidsr.apps.web.home import add_home
from aidsr.apps.web.run_page import add_run_page
from aidsr.apps.web.setup_page import add_setup
from aidsr.apps.web.site import Site
from aidsr.apps.web.study_form import add_study_form
from aidsr.apps.web.study_page import add_study_page


def add_pages(site: Site) -> None:
    """Add every page at its address."""
    run_pages = (add_run_page, add_design_page, add_export_page)
    studies = (add_study_form, add_study_page)
    lists = (add_activities_page, add_designs_page, add_compare_page)
    for add in (add_home, add_setup, *run_pages, *lists, *studies, add_docs):
        add(site)
