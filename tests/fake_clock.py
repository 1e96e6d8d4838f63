from __future__ import annotations

from dataclasses import dataclass, field

from aidsr.teams.providers import Clock


@dataclass
class FakeClock:
    """Time that passes only when somebody sleeps."""

    time_s: float = 0.0
    slept_s: list[float] = field(default_factory=list)

    def sleep(self, seconds: float) -> None:
        self.slept_s.append(seconds)
        self.time_s += seconds

    def clock(self) -> Clock:
        return Clock(now=lambda: self.time_s, sleep=self.sleep)
