"""The report as a page to look at: one HTML file that needs nothing else.

trace      a report with the signals that its faults were read off, and what each actuator did
actuators  what each actuator did
cards      one card for each fault
plots      signals as SVG
html       the page
"""

from aidsr.validation.page.html import GENERATOR, page_html
from aidsr.validation.page.trace import TracedReport, trace_report

__all__ = ["GENERATOR", "TracedReport", "page_html", "trace_report"]
