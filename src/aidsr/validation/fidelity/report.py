"""The results of the fidelity check, as numbers and as text."""

from __future__ import annotations

from typing import Literal

from aidsr.core.artifacts import Artifact

_LEVELS = (
    (1.0, "as close as published models of such robots are to each other"),
    (3.0, "good for shapes and reaches"),
    (10.0, "right in kind, not in detail"),
    (float("inf"), "no basis for numbers"),
)
"""Verdicts, each with the tip error [% of the limb's length] up to which it applies. Source of the first: compared with
a Cosserat rod, chains at the resolution of the guides were 0.94 % off and piecewise constant curvature 0.98 % (medians,
docs/physics.md). The others are our choice."""

_CABLE = "cable "
"""Prefix of the quantity of every comparison that is about a cable."""

_NEVER_SEEN = "Not modelled, so in none of these numbers: cable friction and stretch, shear, hysteresis, plastic bends."


def cable_quantity(cable: str) -> str:
    """Return the quantity of a comparison that is about a cable."""
    return f"{_CABLE}{cable}"


class Comparison(Artifact):
    """One quantity of a limb, simulated and exact."""

    quantity: str
    how: str = ""
    """Load on the limb or other condition of the comparison."""
    unit: str
    exact: float | None = None
    simulated: float | None = None
    error_percent: float | None = None
    """(simulated / exact - 1) of the quantity [%]."""
    tip_error_percent: float | None = None
    """Distance between the simulated and the exact tip [% of the limb's length]."""
    note: str = ""
    """Reason why nothing could be compared, else empty."""

    @property
    def cable(self) -> str | None:
        """Name of the cable that the comparison is about; None for a load."""
        return self.quantity.removeprefix(_CABLE) if self.quantity.startswith(_CABLE) else None

    def __str__(self) -> str:
        """Return the comparison as a line of text."""
        if self.exact is None or self.simulated is None:
            return f"{self.quantity}: {self.note}"
        tip = "" if self.tip_error_percent is None else f", tip off by {self.tip_error_percent:.2g} % of the length"
        numbers = f"simulated {self.simulated:.4g} {self.unit}, exact {self.exact:.4g} {self.unit}"
        return f"{self.quantity} ({self.how}): {numbers}, {self.error_percent:+.2g} %{tip}"


class LimbFidelity(Artifact):
    """The accuracy of the simulation of one limb."""

    name: str
    alike: tuple[str, ...] = ()
    """Names of limbs with the same dimensions and stiffness, for which these results hold too."""
    segments: int
    length_m: float
    joints_at: Literal["middles", "starts"]
    clamp_doubled: bool = False
    comparisons: tuple[Comparison, ...]
    twice_the_segments_percent: float | None = None
    """Distance the tip moves when each segment is split in two [% of the limb's length]; None if that is not
    possible."""
    not_cut: str = ""
    """Reason why the segments cannot be split, else empty."""

    @property
    def load_error_percent(self) -> float | None:
        """Largest tip error of the backbone under a tip load or its own weight [% of the length]; None without any."""
        return max((each.tip_error_percent or 0.0 for each in self._compared(cables=False)), default=None)

    @property
    def cable_error_percent(self) -> float | None:
        """Largest tip error at the full tension of a cable [% of the length]; None without any such comparison."""
        return max((each.tip_error_percent or 0.0 for each in self._compared(cables=True)), default=None)

    @property
    def trust_percent(self) -> float | None:
        """Largest of all tip errors [% of the length]; None if nothing could be compared."""
        errors = (self.load_error_percent, self.cable_error_percent, self.twice_the_segments_percent)
        return max((error for error in errors if error is not None), default=None)

    def account(self) -> str:
        """Return the limb's part of the report as text."""
        joints = "at the starts" if self.joints_at == "starts" else "in the middles"
        alike = f" and {len(self.alike)} like it" if self.alike else ""
        lines = [
            f"limb {self.name}{alike}: {self.segments} segments, {self.length_m:.4g} m, joints {joints} of segments",
            *(f"  {line}" for line in self._lines()),
            f"  twice the segments: {self._when_cut()}",
            f"  verdict: {self._verdict()}",
        ]
        cure = self._cure()
        return "\n".join([*lines, f"  to come closer: {cure}"] if cure else lines)

    def _compared(self, *, cables: bool) -> list[Comparison]:
        """Return the comparisons that have a tip error, either those of cables or all others."""
        found = [each for each in self.comparisons if each.tip_error_percent is not None]
        return [each for each in found if (each.cable is not None) == cables]

    def _lines(self) -> list[str]:
        """Return the comparisons as lines of text; of the cables only the worst, with the number of cables."""
        cables = [each for each in self.comparisons if each.cable is not None]
        others = [str(each) for each in self.comparisons if each not in cables]
        compared = self._compared(cables=True)
        if not compared:
            return [*others, *map(str, cables)]
        worst = max(compared, key=lambda each: each.tip_error_percent or 0.0)
        rest = f"; the worst of {len(cables)} cables" if len(cables) > 1 else ""
        return [*others, f"{worst}{rest}"]

    def _when_cut(self) -> str:
        if self.twice_the_segments_percent is None:
            return f"unknown, {self.not_cut}"
        return f"tip moves by {self.twice_the_segments_percent:.2g} % of the length"

    def _verdict(self) -> str:
        """Return the accuracy of the tip in words, under loads and under its cables."""
        parts = [
            f"{when} the tip is right to {error:.2g} % of the length ({error / 100 * self.length_m * 1000:.2f} mm): "
            + next(words for limit, words in _LEVELS if error <= limit)
            for when, error in (
                ("under loads", self.load_error_percent),
                ("at the full pull of its cables", self.cable_error_percent),
            )
            if error is not None
        ]
        return "; ".join(parts) or "nothing could be compared"

    def _cure(self) -> str:
        load, cable = self.load_error_percent or 0.0, self.cable_error_percent or 0.0
        cures = []
        if load > _LEVELS[0][0]:
            at_starts = self.joints_at == "starts" and not self.clamp_doubled
            cures.append(
                "joints in the middles of segments, or twice the stiffness at the first"
                if at_starts
                else "more segments"
            )
        if cable > _LEVELS[0][0]:
            cures.append("guides on both sides of every joint and nearer to it, or more segments, or a smaller pull")
        return "; ".join(cures)


class FidelityReport(Artifact):
    """The accuracy of the simulation of a robot."""

    limbs: tuple[LimbFidelity, ...]
    left_out: tuple[str, ...] = ()
    """Limbs that do not qualify as elastic rods, each with the reason."""
    timestep_s: float
    half_step_percent: float | None = None
    """Largest distance over all tests that a tip moves when the time step is halved [% of its limb's length]; None if
    unknown."""
    half_step_note: str = ""
    """Reason why `half_step_percent` is unknown, else empty."""
    notes: tuple[str, ...] = ()

    @property
    def trust_percent(self) -> float | None:
        """Largest tip error of all limbs and of the time step [% of a limb's length]; None if nothing is known."""
        errors = [limb.trust_percent for limb in self.limbs]
        return max((error for error in (*errors, self.half_step_percent) if error is not None), default=None)

    def account(self) -> str:
        """Return the report as plain text."""
        parts = [limb.account() for limb in self.limbs]
        parts += [f"limb {reason}" for reason in self.left_out]
        if self.limbs:
            step = f"time step {1000 * self.timestep_s:g} ms"
            if self.half_step_percent is None:
                parts.append(f"{step}: error unknown, {self.half_step_note}")
            else:
                parts.append(
                    f"{step}: with half of it tips move by at most {self.half_step_percent:.2g} % of their limb"
                )
            parts.append(_NEVER_SEEN)
        else:
            parts.append("no limb could be compared with an elastic rod: fidelity unknown")
        return "\n".join([*parts, *self.notes])
