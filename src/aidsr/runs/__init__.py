"""Persistent state of runs: folders, write-once files, event logs, and the status computed from them."""

from aidsr.runs.events import EventLog, read_events
from aidsr.runs.folders import RUN_FILE, DesignFolder, IterationFolder, Run, new_run
from aidsr.runs.layout import LAYOUT, layout_text
from aidsr.runs.library import Library
from aidsr.runs.record import RunRecord
from aidsr.runs.recorded_model import RecordedModel
from aidsr.runs.status import DesignStatus, RunStatus, read_status
from aidsr.runs.summary import write_summary

__all__ = [
    "LAYOUT",
    "RUN_FILE",
    "DesignFolder",
    "DesignStatus",
    "EventLog",
    "IterationFolder",
    "Library",
    "RecordedModel",
    "Run",
    "RunRecord",
    "RunStatus",
    "layout_text",
    "new_run",
    "read_events",
    "read_status",
    "write_summary",
]
