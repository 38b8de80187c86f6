"""Linkage (David Rector): files ``.linkage2``.

Connectors are points of the drawing, y up; links are sets of connectors. A connector of two links
is a pin, one that is an anchor a pin on the ground, one that is a slider runs between two
connectors of another link. An input turns its link clockwise at its rpm; an actuator goes its throw
and back, cpm times a minute. Ids of links and of connectors are counted apart. A unit of the file
is 1/96 inch.
Source: CLinkageDoc::ReadIn, CSimulator and CConnector of github.com/stainlessio/Linkage.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element as Node

from mbody.core.tolerances import FILE_RADII_SAME
from mbody.exchange.imported import (
    GROUND,
    DrawnLinkage,
    Imported,
    Place,
    back_and_forth,
    number_of,
    refusal,
    seen,
)
from mbody.quantities.units import unit_system

FORM = "Linkage"
PER_INCH = 96.0
INCH = 25.4  # mm
#: The layer of mechanisms; all others are drawings.
MECHANISM = 16
#: Attributes that are read, and those of the drawing.
CONNECTOR_ATTRIBUTES = (
    "id", "x", "y", "name", "layer", "anchor", "input", "rpm", "slider", "slideradius", "fasten",
    "fastenlink", "measurementelement", "draw", "drawcircle", "color", "selected", "linesize",
    "locked", "alwaysmanual", "limitangle", "startoffset",
)  # fmt: skip
LINK_ATTRIBUTES = (
    "id", "name", "layer", "actuator", "throw", "cpm", "gear", "fastenlink", "fastenconnector",
    "measurementelement", "linesize", "solid", "locked", "color", "selected", "alwaysmanual",
    "startoffset", "fasten",
)  # fmt: skip
#: What a file may have at its top beside connectors, links and ratios, and what is not mechanics.
LOOKS = ("program", "selected", "background")


@dataclass
class _Connector:
    """A point of the drawing, and the links that have it."""

    id: int
    at: Place
    node: Node
    links: list[str] = field(default_factory=list)
    #: How many links have it.
    count: int = 0

    @property
    def name(self) -> str:
        label = self.node.get("name")
        return f"the connector {self.id}" + (f" ({label})" if label else "")

    @property
    def label(self) -> str:
        return self.node.get("name") or f"P{self.id}"

    def has(self, word: str) -> bool:
        """Whether it is marked so."""
        return self.node.get(word) == "true"


@dataclass
class _Member:
    """A link of the drawing, and the body that it is; none where it is a cylinder or a point."""

    id: int
    node: Node
    connectors: list[_Connector]
    body: str = ""

    @property
    def name(self) -> str:
        return f"the link {self.id}"

    def has(self, word: str) -> bool:
        """Whether it is marked so."""
        return self.node.get(word) == "true"

    @property
    def fastened(self) -> bool:
        """Whether it moves with something else."""
        return bool(self.node.get("fastenlink") or self.node.get("fastenconnector"))


def linkage2_from_xml(root: Node, name: str, units: str | None) -> Imported:
    """The linkage of a file."""
    program = root.find("program")
    inches = program is not None and (program.get("units") or "").lower() == "inches"
    system = units or ("in-lbf-s" if inches else "mm-N-s")
    factor = _factor(root, system)
    return _DrawingReader(DrawnLinkage(name, FORM, system), root, factor).whole()


def _factor(root: Node, system: str) -> float:
    """Lengths of the unit system in a unit of the file."""
    return INCH / PER_INCH * 1e-3 / unit_system(system).unit("length").factor


class _DrawingReader:
    def __init__(self, made: DrawnLinkage, root: Node, factor: float) -> None:
        self.made, self.root, self.factor = made, root, factor
        self.connectors: dict[int, _Connector] = {}
        self.links: list[_Member] = []

    def whole(self) -> Imported:
        self._refuse_others()
        for node in self._mechanical("connector"):
            self._add_connector(node)
        for node in itertools.chain(self._mechanical("Link"), self._mechanical("element")):
            self._add_link(node)
        for link in self.links:
            self._embody(link)
        self._fasten_connectors()
        for connector in self.connectors.values():
            self._join(connector)
        for connector in self.connectors.values():
            if connector.has("slider"):
                self._slide(connector)
        for link in self.links:
            self._fasten_link(link)
            if link.has("actuator"):
                self._actuator(link)
        for ratio in self.root.iterfind("ratios/ratio"):
            self._ratio(ratio)
        for connector in self.connectors.values():
            if connector.has("input"):
                self._rotate(connector)
        return self._noted().imported()

    def _refuse_others(self) -> None:
        known = ("connector", "Link", "element", "ratios", *LOOKS)
        for node in self.root:
            if node.tag not in known:
                raise refusal(f"the element <{node.tag}>", "there is no such thing in a linkage")

    def _mechanical(self, tag: str) -> Iterator[Node]:
        """Elements of the mechanism; drawings are noted."""
        drawn = []
        for node in self.root.iterfind(tag):
            layer = node.get("layer") or "0"
            if layer in ("0", str(MECHANISM)) and node.get("measurementelement") != "true":
                yield node
            else:
                drawn.append(node.get("id") or "?")
        if drawn:
            what = "connectors" if tag == "connector" else "links"
            self.made.notes.append(f"{what} that only draw or measure: {', '.join(drawn)}")

    def _id(self, node: Node, what: str) -> int:
        text = node.get("id")
        try:
            return int(text or "")
        except ValueError:
            raise refusal(f"{what} {seen(text)}", "its id is no whole number") from None

    def _add_connector(self, node: Node) -> None:
        id_ = self._id(node, "the connector")
        element = f"the connector {id_}"
        if id_ in self.connectors:
            raise refusal(element, "there are two of this id")
        x, y = (self.factor * number_of(node.get(key), element, key) for key in ("x", "y"))
        self._check_attributes(node, element, CONNECTOR_ATTRIBUTES)
        self.connectors[id_] = _Connector(id_, (x, y), node)

    def _check_attributes(self, node: Node, element: str, known: Iterable[str]) -> None:
        """Refuse attributes that change a motion and are not read; note the others."""
        self.made.note_keys(element, node.attrib, known)
        for key in ("limitangle", "startoffset"):
            if number_of(node.get(key) or 0.0, element, key):
                raise refusal(
                    element,
                    f"its {key} is not 0: an input that swings or starts elsewhere is not read",
                )
        if node.get("alwaysmanual") == "true":
            self.made.notes.append(f"{element} is moved by hand in Linkage: here it has its speed")

    def _members(self, node: Node, element: str) -> list[_Connector]:
        """The connectors of a link."""
        found = []
        for child in node:
            if child.tag not in ("connector", "fastenconnector"):
                raise refusal(element, f"its part <{child.tag}> is not read")
            if child.tag == "connector":
                found.append(self._connector(child, element))
        return found

    def _connector(self, node: Node, element: str) -> _Connector:
        id_ = self._id(node, f"{element}: the connector")
        if id_ not in self.connectors:
            raise refusal(element, f"it refers to the connector {id_}, which is not there")
        return self.connectors[id_]

    def _add_link(self, node: Node) -> None:
        id_ = self._id(node, "the link")
        link = _Member(id_, node, self._members(node, f"the link {id_}"))
        self._check_attributes(node, link.name, LINK_ATTRIBUTES)
        self.links.append(link)
        if not link.has("actuator"):  # that is a cylinder between other links
            for one in link.connectors:
                one.count += 1

    def _embody(self, link: _Member) -> None:
        """The body of a link: its own, the ground with two anchors, none of one point."""
        if link.has("actuator"):
            return
        pins = [one for one in link.connectors if one.has("anchor") and not one.has("slider")]
        fixed = len({one.at for one in pins}) > 1
        if fixed:
            self.made.notes.append(f"{link.name} has two anchors: it is part of the ground")
        wanted = any(other.node.get("fastenlink") == str(link.id) for other in self.links)
        if len(link.connectors) == 1 and not (link.has("gear") or link.fastened or wanted):
            (point,) = link.connectors
            if not point.has("anchor") and point.count > 1:
                return  # a point of other links
            fixed = point.has("anchor")
        link.body = GROUND if fixed else self.made.link(link.node.get("name") or f"link{link.id}")
        for one in link.connectors:
            self.made.point(link.body, one.label, one.at)
            one.links.append(link.body)

    def _fasten_connectors(self) -> None:
        """Connectors that are fastened to a link are points of it."""
        for connector in self.connectors.values():
            id_ = connector.node.get("fastenlink") or connector.node.get("fasten")
            if id_:
                self._fasten(connector, self._link(id_, connector.name).body)
        for link in self.links:
            for child in link.node.iterfind("fastenconnector"):
                id_ = child.get("id") or ""
                if id_.isdigit() and int(id_) in self.connectors and link.body:
                    self._fasten(self.connectors[int(id_)], link.body)

    def _fasten(self, connector: _Connector, body: str) -> None:
        self.made.point(body, connector.label, connector.at)
        if body not in connector.links:
            connector.links.append(body)

    def _link(self, id_: str | None, element: str) -> _Member:
        """The first link of an id: older files use some ids twice."""
        for link in self.links:
            if str(link.id) == id_ and link.body:
                return link
        raise refusal(element, f"it refers to the link {seen(id_)}, which is not there")

    def _join(self, connector: _Connector) -> None:
        """The pins of a connector: all its links on one, on the ground where it is an anchor."""
        links = list(dict.fromkeys(connector.links))
        if connector.has("anchor") and GROUND not in links:
            links.insert(0, GROUND)
        for link in links[1:]:
            self.made.pin(connector.label, links[0], link, connector.at)

    def _slide(self, connector: _Connector) -> None:
        element = connector.name
        ends = [self._connector(node, element) for node in connector.node.iterfind("slidelimit")]
        if len(ends) != 2:
            raise refusal(element, f"a slider has two limits, not {len(ends)}")
        first, last = ends
        shared = [link for link in first.links if link in last.links]
        if first.has("anchor") and last.has("anchor"):
            shared.insert(0, GROUND)
        own = GROUND if connector.has("anchor") else next(iter(connector.links), "")
        guides = [link for link in shared if link != own]
        if not guides or not own:
            what = "is on no link" if not own else "its limits are on no link that it could run on"
            raise refusal(element, f"it is a slider, but {what}")
        radius = number_of(connector.node.get("slideradius") or 0.0, element, "the slide radius")
        if radius:
            centre = self._centre(connector, first.at, last.at, abs(radius) * self.factor)
            self.made.arc(connector.label, guides[0], own, connector.at, centre)
        else:
            along = math.atan2(last.at[1] - first.at[1], last.at[0] - first.at[0])
            self._on_line(connector, first.at, along)
            self.made.slot(connector.label, guides[0], own, connector.at, along)
        ends_of_it = f"{first.label} and {last.label}"
        self.made.notes.append(
            f"{element} slides on {guides[0]}: its ends, {ends_of_it}, are no stops"
        )

    def _on_line(self, connector: _Connector, start: Place, angle: float) -> None:
        """Refuse a slider that is drawn beside its line."""
        x, y = connector.at[0] - start[0], connector.at[1] - start[1]
        distance = abs(y * math.cos(angle) - x * math.sin(angle))
        size = max(math.dist(a.at, b.at) for a in self.connectors.values() for b in [connector])
        if distance > FILE_RADII_SAME * size:
            raise refusal(
                connector.name,
                f"it is drawn {distance:g} {self.made.length_unit} beside the line of its limits",
            )

    def _centre(self, connector: _Connector, a: Place, b: Place, radius: float) -> Place:
        """The centre of an arc through two places, on which the connector is drawn."""
        half = math.dist(a, b) / 2
        radius = max(radius, half)
        height = math.sqrt(max(radius * radius - half * half, 0.0))
        u = ((b[0] - a[0]) / (2 * half), (b[1] - a[1]) / (2 * half)) if half else (1.0, 0.0)
        middle = ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2)
        centres = [(middle[0] - s * u[1], middle[1] + s * u[0]) for s in (height, -height)]
        best = min(centres, key=lambda centre: abs(math.dist(centre, connector.at) - radius))
        if abs(math.dist(best, connector.at) - radius) > FILE_RADII_SAME * radius:
            raise refusal(
                connector.name, f"it is not drawn on its arc of {radius:g} {self.made.length_unit}"
            )
        return best

    def _fasten_link(self, link: _Member) -> None:
        """Weld a link to the link, or to the link of the connector, that it is fastened to."""
        if not link.fastened:
            return
        if not link.body:
            raise refusal(link.name, "an actuator that is fastened to a link is not read")
        if other := link.node.get("fastenlink"):
            carrier = self._link(other, link.name).body
        else:
            id_ = link.node.get("fastenconnector") or ""
            if not id_.isdigit() or int(id_) not in self.connectors:
                raise refusal(link.name, f"it is fastened to {seen(id_)}, which is not there")
            target = self.connectors[int(id_)]
            others = [body for body in target.links if body != link.body]
            if not others and not target.has("anchor"):
                raise refusal(link.name, f"it is fastened to {target.name}, which is on no link")
            carrier = GROUND if target.has("anchor") else others[0]
        if carrier != link.body and link.connectors:
            self.made.weld(f"weld_{link.body}", carrier, link.body, link.connectors[0].at)

    def _actuator(self, link: _Member) -> None:
        element = f"the actuator {link.id}"
        node, members = link.node, link.connectors
        if len(members) != 2:
            raise refusal(element, f"an actuator has two connectors, not {len(members)}")
        ends = []
        for one in members:
            carrier = GROUND if one.has("anchor") else next(iter(one.links), None)
            if carrier is None:
                raise refusal(element, f"{one.name} is on no other link")
            ends.append(self.made.point(carrier, one.label, one.at))
        length = math.dist(members[0].at, members[1].at)
        throw = self.factor * number_of(node.get("throw") or 0.0, element, "the throw")
        cycles = number_of(node.get("cpm") or 15.0, element, "cpm")
        if not cycles or not throw:
            raise refusal(
                element, f"its throw is {throw:g} and its cpm {cycles:g}: it does not move"
            )
        end = length + math.copysign(throw, cycles)
        law = back_and_forth([length, end, length], abs(throw * cycles) / 30.0)
        self.made.stretch(node.get("name") or f"actuator{link.id}", ends[0], ends[1], law)
        self.made.notes.append(f"{element} goes back and forth at constant speed")

    def _ratio(self, ratio: Node) -> None:
        parts = list(ratio.iterfind("link"))
        element = "the ratio of " + " and ".join(f"link {part.get('id')}" for part in parts)
        if len(parts) != 2:
            raise refusal(element, "a ratio has two links")
        wheels = [self._link(part.get("id"), element) for part in parts]
        links = [wheel.body for wheel in wheels]
        sizes = [number_of(part.get("size"), element, "the size") for part in parts]
        if min(sizes) <= 0.0:
            raise refusal(element, "sizes of wheels must be positive")
        for wheel in wheels:
            if not wheel.connectors:
                raise refusal(element, f"{wheel.name} has no connector")
        centres = [wheel.connectors[0] for wheel in wheels]
        shared = [link for link in centres[0].links if link in centres[1].links]
        carriers = [link for link in shared if link not in links]
        if centres[0].has("anchor") and centres[1].has("anchor"):
            carriers.append(GROUND)
        if not carriers:
            raise refusal(element, "no link carries both wheels")
        sign = -1.0 if ratio.get("type") == "chain" else 1.0
        terms = [(sizes[0], links[0], carriers[0]), (sign * sizes[1], links[1], carriers[0])]
        self.made.ratio(f"{'chain' if sign < 0 else 'gears'}_{links[0]}_{links[1]}", terms)

    def _rotate(self, connector: _Connector) -> None:
        element = connector.name
        rpm = number_of(connector.node.get("rpm") or 15.0, element, "rpm")
        links = [
            link.body
            for link in self.links
            if connector in link.connectors and link.body not in ("", GROUND) and not link.fastened
        ]
        if not links:
            self.made.notes.append(f"{element} is an input of no link: it is left out")
            return
        if not connector.has("anchor"):
            raise refusal(element, "it is an input that is no anchor")
        if len(links) != 1:
            raise refusal(element, f"it is an input of {len(links)} links: one can be driven")
        self.made.rotate(GROUND, links[0], -rpm * math.tau / 60.0)

    def _noted(self) -> DrawnLinkage:
        notes = self.made.notes
        loose = [str(one.id) for one in self.connectors.values() if not one.links]
        loose = [id_ for id_ in loose if not self._used(id_)]
        if loose:
            notes.append(f"connectors of no link are left out: {', '.join(loose)}")
        program = self.root.find("program")
        scale = (program.get("scalefactor") if program is not None else None) or "1"
        if float(number_of(scale, "the element <program>", "scalefactor")) != 1.0:
            notes.append(f"the drawing's scale factor, {scale}, is not applied to lengths")
        notes.append(
            f"a unit of the drawing is 1/96 inch, {self.factor:.8g} {self.made.length_unit}; "
            "inputs turn clockwise at a positive rpm"
        )
        return self.made

    def _used(self, id_: str) -> bool:
        """Whether a connector of no link is an end of something."""
        slides = any(n.get("id") == id_ for n in self.root.iterfind("connector/slidelimit"))
        return slides or any(
            child.get("id") == id_
            for link in self.links
            if link.has("actuator")
            for child in link.node
        )
