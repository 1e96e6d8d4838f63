"""Feed thousands of broken robots to the validator and check that it always returns an answer.

    python -m benchmarks.validator.fuzz --cases 10000 --battery 500

Requirements: the caller never crashes, sees only the documented exceptions, and has each answer within 20 s of
processor time; no process is left behind; no file is made in the working directory, and none is read or changed in a
folder that documents name on purpose.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.validator.corpus.writers import ALL_WRITERS
from benchmarks.validator.load_only import load_only
from benchmarks.validator.mutation import mutate

from aidsr.core.errors import IsolationError, MjcfError
from aidsr.core.provenance import commit
from aidsr.validation import validate

_HERE = Path(__file__).parent
_LONGEST_S = 20.0
"""Largest processor time of one case [s]; wall time would depend on other programs. Source: promise of this project;
our choice."""


@dataclass
class Campaign:
    """Results of many cases.

    Attributes:
        endings: Number of calls by ending: "accepted", "refused", "failed", or the kind of an IsolationError.
        codes: Number of cases by reported fault code.
        isolated: Cases that ended their worker process, with the message.
        failures: Cases in which a requirement was violated, with the reason.
        longest: Processor time [s] and number of the case that took longest. The time is an upper bound, because cases
            that run at the same time are counted too.
    """

    endings: Counter[str] = field(default_factory=Counter)
    codes: Counter[str] = field(default_factory=Counter)
    isolated: dict[int, str] = field(default_factory=dict)
    failures: dict[int, str] = field(default_factory=dict)
    longest: tuple[float, int] = (0.0, -1)

    @classmethod
    def read(cls, kept: dict[str, dict[str, Any]]) -> Campaign:
        """Return a campaign from its JSON form."""
        isolated, failures = (
            {int(index): text for index, text in kept[name].items()} for name in ("isolated", "failures")
        )
        spent_s, index = kept["longest"]
        return cls(Counter(kept["endings"]), Counter(kept["codes"]), isolated, failures, (spent_s, index))


def seeds() -> list[str]:
    """Return the robots that mutations start from: two of every writer."""
    return [writer(np.random.default_rng([3, number])).mjcf for writer in ALL_WRITERS.values() for number in range(2)]


def case_text(index: int, seed: int, documents: Sequence[str], canary: str) -> str:
    """Return the document of one case, which depends only on seed and index."""
    return mutate(documents, np.random.default_rng([seed, index]), canary)


def run_case(text: str, *, battery: bool) -> tuple[str, list[str]]:
    """Validate one document; return the ending and the reported codes.

    Raises:
        Exception: Any exception that the validator must not raise.
    """
    if battery:
        report = validate(text)
        return "accepted" if report.stable else "refused", [fault.code for fault in report.faults]
    try:
        report = load_only(text)
    except MjcfError as error:
        return "refused", [fault.code for fault in error.faults]
    except IsolationError as error:
        return error.kind, [str(error)]
    codes = [fault.code for fault in report.faults]
    return "refused" if codes else "accepted", codes


def run_campaign(
    indices: Sequence[int], seed: int, canary: str, kept: Path, *, battery: bool, threads: int = 2
) -> Campaign:
    """Run some cases. Each case that fails is written to a file, from which it can be run again."""
    documents, campaign = seeds(), Campaign()

    def run(index: int) -> tuple[int, str, list[str], str, float]:
        text, failure = case_text(index, seed, documents, canary), ""
        began_s = processor_s()
        try:
            ending, codes = run_case(text, battery=battery)
        except Exception as error:  # the campaign reports any exception and continues
            ending, codes, failure = "failed", [], f"{type(error).__name__}: {error}"
        spent_s = processor_s() - began_s
        if spent_s > _LONGEST_S and not failure:
            failure = f"took {spent_s:.1f} s of processor time, {ending}"
        if failure:
            kept.mkdir(parents=True, exist_ok=True)
            kept.joinpath(f"case-{seed}-{index}.xml").write_bytes(text.encode("utf-8", "surrogatepass"))
        return index, ending, codes, failure, spent_s

    with ThreadPoolExecutor(threads) as pool:
        for done, (index, ending, codes, failure, spent_s) in enumerate(pool.map(run, indices), start=1):
            campaign.endings[ending] += 1
            campaign.longest = max(campaign.longest, (spent_s, index))
            if failure:
                campaign.failures[index] = failure
            elif ending in ("time", "memory", "crash"):
                campaign.isolated[index] = codes[0]
            else:
                campaign.codes.update(set(codes))
            if done % 1000 == 0:
                _say(f"{done} of {len(indices)}: {dict(campaign.endings)}")
    return campaign


def processor_s() -> float:
    """Return the processor time of this process and its children, including ended ones [s]. Linux only."""
    spent_s = sum(os.times()[:4])
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # the process has ended meanwhile
            fields = folder.joinpath("stat").read_text("utf-8", "replace").rpartition(")")[2].split()
            if int(fields[1]) == os.getpid():
                spent_s += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return spent_s


# --- what must not happen --------------------------------------------------------------------------------------------


def fingerprint(folder: Path) -> dict[str, str]:
    """Return a digest of every file below a folder, with its time of change."""
    return {
        str(path.relative_to(folder)): f"{hashlib.sha256(path.read_bytes()).hexdigest()} {path.stat().st_mtime_ns}"
        for path in _files(folder)
    }


def mark_unread(folder: Path) -> None:
    """Set the time of access of every file below a folder to 0, so that `files_read` sees the next read.

    A file system with relatime renews a time of access only where it is before the file's last change.
    """
    for path in _files(folder):
        os.utime(path, ns=(0, path.stat().st_mtime_ns))


def files_read(folder: Path) -> list[str]:
    """Return the files below a folder that were read since `mark_unread`, or made since and read."""
    return [str(path.relative_to(folder)) for path in _files(folder) if path.stat().st_atime_ns]


def reads_show() -> bool:
    """Return whether the file system of temporary files records times of access (not with noatime)."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "read.txt")
        path.write_text("read", "utf-8")
        mark_unread(Path(folder))
        path.read_bytes()
        return bool(files_read(Path(folder)))


def _files(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.rglob("*")) if path.is_file()]


def marked_processes(marker: str) -> list[int]:
    """Return the processes whose environment contains a marker. Linux only; none on other systems."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            environment = folder.joinpath("environ").read_bytes()
        except OSError:  # the process has ended meanwhile, or belongs to another user
            continue
        if marker.encode() in environment and int(folder.name) != os.getpid():
            found.append(int(folder.name))
    return found


def make_canary(folder: Path) -> None:
    """Fill a folder with files that documents try to read and overwrite."""
    folder.joinpath("model.xml").write_text("<mujoco><worldbody/></mujoco>", "utf-8")
    folder.joinpath("secret.txt").write_text("not to be read", "utf-8")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run both campaigns in a separate process and write `fuzz.md`; exit with 1 if a requirement is violated."""
    options = _options(arguments)
    if options.replay:
        text = options.replay.read_bytes().decode("utf-8", "surrogatepass")
        _say(json.dumps([run_case(text, battery=False), run_case(text, battery=True)], indent=1))
        return
    if options.inner:
        _run_inner(options)
        return
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as canary, tempfile.TemporaryDirectory() as work:
        make_canary(Path(canary))
        untouched = fingerprint(Path(canary))
        mark_unread(Path(canary))
        result = Path(canary).with_suffix(".json")
        code = _run_outer(options, canary, work, result)
        touched = [f"in the working directory: {name}" for name in fingerprint(Path(work))]
        touched += [f"in the canary folder, read: {name}" for name in files_read(Path(canary))]
        changed = set(fingerprint(Path(canary)).items()) ^ set(untouched.items())
        touched += [f"in the canary folder, changed: {name}" for name, _ in changed]
        left = _left_behind(canary)
    if code:
        sys.exit(f"the campaign itself ended with exit code {code}")
    light, heavy = (Campaign.read(kept) for kept in json.loads(result.read_text("utf-8")))
    result.unlink()
    text = _markdown(options, light, heavy, touched, left, time.monotonic() - began)
    options.out.joinpath("fuzz.md").write_text(text, "utf-8")
    if light.failures or heavy.failures or touched or left:
        _say(text)
        sys.exit(1)


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=1000, help="through load and structure")
    parser.add_argument("--battery", type=int, default=50, help="through the whole validation")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kept", type=Path, default=Path("build/validator/fuzz"), help="where failing cases are kept")
    parser.add_argument("--out", type=Path, default=_HERE, help="folder of fuzz.md")
    parser.add_argument("--replay", type=Path, help="run one kept case instead")
    parser.add_argument("--inner", nargs=2, metavar=("CANARY", "RESULT"), help="used by the program itself")
    return parser.parse_args(arguments)


def _run_outer(options: argparse.Namespace, canary: str, work: str, result: Path) -> int:
    """Run the campaigns in another process; the canary's name in its environment marks it and its children."""
    root = str(_HERE.parents[1])
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([root, canary])}
    command = [sys.executable, "-m", "benchmarks.validator.fuzz", "--inner", canary, str(result)]
    command += ["--cases", str(options.cases), "--battery", str(options.battery), "--seed", str(options.seed)]
    command += ["--kept", str(options.kept.resolve())]
    return subprocess.run(command, cwd=work, env=environment, check=False).returncode


def _run_inner(options: argparse.Namespace) -> None:
    canary, result = options.inner
    light = run_campaign(range(options.cases), options.seed, canary, options.kept, battery=False)
    heavy_cases = range(options.cases, options.cases + options.battery)
    heavy = run_campaign(heavy_cases, options.seed, canary, options.kept, battery=True)
    Path(result).write_text(json.dumps([vars(light), vars(heavy)]), "utf-8")


def _left_behind(marker: str) -> list[int]:
    """Return the processes that still exist 5 s after the campaign's end."""
    for _ in range(50):
        if not marked_processes(marker):
            return []
        time.sleep(0.1)
    return marked_processes(marker)


def _markdown(
    options: argparse.Namespace, light: Campaign, heavy: Campaign, touched: list[str], left: list[int], spent_s: float
) -> str:
    def endings(campaign: Campaign) -> str:
        return ", ".join(f"{count} {ending}" for ending, count in sorted(campaign.endings.items())) or "none"

    failures = light.failures | heavy.failures
    isolated = light.isolated | heavy.isolated
    spent_longest_s, longest = max(light.longest, heavy.longest)
    codes = ", ".join(f"`{code}` {count}" for code, count in (light.codes + heavy.codes).most_common())
    unseen = "" if reads_show() else "; reads are not counted: the file system keeps no times of access"
    made_by = f"`make fuzz CASES={options.cases} BATTERY={options.battery}` at {commit()}"
    return f"""# What broken documents do to the validator

Made by {made_by}, seed {options.seed}: {spent_s / 60:.1f} min.

| | |
|---|---|
| documents through load and structure | {options.cases}: {endings(light)} |
| documents through the whole validation | {options.battery}: {endings(heavy)} |
| crashes of the caller, undocumented exceptions, cases beyond {_LONGEST_S:g} s of processor time | {len(failures)} |
| longest case | at most {spent_longest_s:.1f} s of processor time (case {longest}) |
| files touched | {len(touched)}{unseen} |
| processes left behind | {len(left)} |
| calls ended by isolation (native crash, time, memory) | {len(isolated)} |

Faults reported: {codes}.

{_listing("Failures", failures)}
{_listing("Ended by isolation, which is its job", isolated)}
{_listing("Files touched", dict(enumerate(touched)))}"""


def _listing(title: str, entries: dict[int, str]) -> str:
    if not entries:
        return ""
    shown = "\n".join(f"- case {index}: {text.splitlines()[0][:200]}" for index, text in sorted(entries.items())[:50])
    return f"## {title}\n\n{shown}\n"


def _say(text: str) -> None:
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


if __name__ == "__main__":
    main()
