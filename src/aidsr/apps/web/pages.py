"""All pages of the site."""

from __future__ import annotations

from aidsr.apps.web.design_page import add_design_page
from aidsr.apps.web.export_page import add_export_page
from aidsr.apps.web.home import add_home
from aidsr.apps.web.run_page import add_run_page
from aidsr.apps.web.setup_page import add_setup
from aidsr.apps.web.site import Site


def add_pages(site: Site) -> None:
    """Make every page answer at its address."""
    for add in (add_home, add_setup, add_run_page, add_design_page, add_export_page):
        add(site)
