"""The report page: one self-contained HTML file.

trace      a report with a signal for each fault and a trace of each actuator
actuators  the trace of each actuator
cards      one card for each fault
plots      signals as SVG
html       the page
"""

from aidsr.validation.page.html import GENERATOR, page_html
from aidsr.validation.page.trace import TracedReport, trace_report

__all__ = ["GENERATOR", "TracedReport", "page_html", "trace_report"]
