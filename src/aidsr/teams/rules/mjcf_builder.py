"""A small typed builder of MJCF: one document with MuJoCo's sections in their usual order."""

from __future__ import annotations

from lxml import etree

from aidsr.mjcf.edit import Value, format_value
from aidsr.sim import beam

TIMESTEP_S = 0.002
"""Physics step of the benchmark's environments [s]."""

WINCH_TIME_CONSTANT_S = 0.05
"""First-order lag between commanded and actual tension [s]. Source: docs/physics.md, recommendation for winches."""

PALETTE = {
    "base": "0.16 0.18 0.22 1",
    "link_light": "0.88 0.90 0.92 1",
    "link_dark": "0.42 0.56 0.66 1",
    "working": "0.96 0.52 0.14 1",
    "guide": "0.10 0.10 0.12 1",
}
"""Colours of all built-in robots: base, alternating segments, the part that does the work, cable guides."""

_SECTIONS = (
    "compiler",
    "option",
    "default",
    "asset",
    "worldbody",
    "contact",
    "equality",
    "tendon",
    "actuator",
    "sensor",
)


def add(parent: etree._Element, tag: str, **attributes: Value) -> etree._Element:
    """Append an element. Attribute names such as `class_` and `range_` lose their trailing underscore."""
    element = etree.SubElement(parent, tag)
    for key, value in attributes.items():
        element.set(key.rstrip("_"), format_value(value))
    return element


def add_comment(parent: etree._Element, words: str) -> None:
    """Append an XML comment."""
    parent.append(etree.Comment(f" {words} "))


class MjcfBuilder:
    """An MJCF document under construction, with the settings every built-in robot shares.

    Attributes:
        worldbody: Section for the root body; other sections are attributes with the names of their tags.
    """

    def __init__(self, model: str, about: str, variation: int = 0) -> None:
        self.root = etree.Element("mujoco", model=model if variation == 0 else f"{model}_variation_{variation}")
        add_comment(self.root, about)
        self._sections = {tag: add(self.root, tag) for tag in _SECTIONS}
        self.worldbody = self._sections["worldbody"]
        self.default = self._sections["default"]
        self.contact = self._sections["contact"]
        self.equality = self._sections["equality"]
        self.tendon = self._sections["tendon"]
        self.actuator = self._sections["actuator"]
        self.sensor = self._sections["sensor"]
        self._set_up()

    def _set_up(self) -> None:
        self._sections["compiler"].attrib.update({"angle": "radian", "autolimits": "true"})
        option = self._sections["option"]
        option.set("timestep", format_value(TIMESTEP_S))
        option.set("integrator", "implicitfast")
        for name, rgba in PALETTE.items():
            add(self._sections["asset"], "material", name=name, rgba=rgba, specular=0.3, shininess=0.4)
        # Light links need stiff contacts and limits: MuJoCo's defaults scale with mass and would let them sink.
        stiff = beam.solref(TIMESTEP_S)
        add(self.default, "geom", solref=stiff, solimp=beam.SOLIMP, friction=(0.9, 0.005, 0.0001))
        add(self.default, "joint", solreflimit=stiff, solimplimit=beam.SOLIMP)
        add(self.default, "site", type="sphere", size=(0.0015,), material="guide")
        add(self.default, "tendon", width=0.0009, rgba="0.85 0.16 0.16 1")
        winch = add(self.default, "default", class_="winch")
        add_comment(winch, "control is the tension in newton; the gain of -1 makes a cable pull and never push")
        add(winch, "general", gainprm=(-1.0,), biastype="none", dyntype="filterexact", dynprm=(WINCH_TIME_CONSTANT_S,))

    def exclude(self, first: str, second: str) -> None:
        """Exclude contacts between two bodies, such as neighbours in a chain."""
        add(self.contact, "exclude", body1=first, body2=second)

    def text(self) -> str:
        """Return the document, indented, without empty sections."""
        for section in self._sections.values():
            if len(section) == 0 and not section.attrib:
                self.root.remove(section)
        etree.indent(self.root, space="  ")
        return etree.tostring(self.root, encoding="unicode") + "\n"
