"""The report as a page to look at: one HTML file that needs nothing else.

signals    what a fault was read off, over time
acting     what each actuator did
tracing    both, in the worker that drives the robot
asking     the same for callers
plots      signals drawn
writing    the page
"""

from aidsr.validation.page.asking import Traced, traced
from aidsr.validation.page.writing import GENERATOR, page_html

__all__ = ["GENERATOR", "Traced", "page_html", "traced"]
