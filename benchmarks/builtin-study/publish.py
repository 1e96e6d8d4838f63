"""Write the report of a study and keep a copy in this folder: page, tables, raw rows, plan and submission.

python benchmarks/builtin-study/publish.py build/builtin-60000 trained
python benchmarks/builtin-study/publish.py build/ablations ablations
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from aidsr.studies.report import write_report
from aidsr.studies.study import open_study
from aidsr.studies.submission import submit

HERE = Path(__file__).parent
KEPT = ("report.html", "report.md", "report.csv", "study.toml")
MOST_BYTES = 5_000_000
"""Largest allowed size of a report's page in the repository [bytes]."""


def main() -> None:
    """Write a study's report and copy it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", type=Path)
    parser.add_argument("name", help="of the folder here")
    asked = parser.parse_args()
    study, folder = open_study(asked.study), HERE / asked.name
    page = write_report(study)
    if page.stat().st_size > MOST_BYTES:
        sys.exit(f"{page} has {page.stat().st_size:,} bytes; at most {MOST_BYTES:,} are kept here")
    folder.mkdir(exist_ok=True)
    for name in KEPT:
        shutil.copyfile(study.path / name, folder / name)
    submit(study, folder / "submission.json")


if __name__ == "__main__":
    main()
