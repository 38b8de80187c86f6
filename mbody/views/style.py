"""How pictures look: colours, widths and sizes, so that all of them belong together.

The colours are of the palette of M. Okabe and K. Ito, which the colour-blind tell apart; beside
their hue they differ in lightness, so that they can be told apart in print too.
"""

from __future__ import annotations

__all__ = ["CURVES", "FONTS", "MATHS", "SIZE", "SOFT", "Z"]

INK = "#26323f"  # outlines of links, pins, text
LINK = "#dde5ec"  # what links are filled with
PLATE = "#eaeff4"  # what reaches far
WHEEL = "#f3f6f9"  # behind the links
GROUND = "#59636e"  # supports, rails, hatching
SOFT = "#7d8894"  # paths, scales, remarks
LOAD = "#d55e00"
FORCE = "#0072b2"
DRIVE = "#00795a"
PAPER = "#ffffff"

#: Curves of a plot, in this order; the dashes tell them apart where colours do not.
CURVES = (
    ("#0072b2", "-"),
    ("#d55e00", (0, (6, 1.5))),
    ("#00795a", (0, (4, 1.2, 1.2, 1.2))),
    ("#26323f", (0, (1.4, 1.2))),
    ("#cc79a7", (0, (8, 1.5, 1.5, 1.5, 1.5, 1.5))),
    ("#e69f00", (0, (2.5, 1))),
)

#: Both come with matplotlib, so that a picture is the same on every machine.
FONTS = ["STIXGeneral", "DejaVu Sans"]
MATHS = "stix"

#: Sizes in points.
SIZE = {
    "width": 330.0,  # of the mechanism in a picture, at most
    "height": 230.0,
    "margin": 12.0,
    "link": 4.2,  # half the width of a link
    "pin": 3.6,
    "block": 11.0,  # half the length of a slider
    "support": 13.0,  # height of the triangle below a ground pin
    "hatch": 4.5,
    "arrow": 74.0,  # the longest
    "arc": 19.0,  # radius of the arrow of a motor
    "text": 9.5,
    "title": 11.5,
}

#: What lies above what.
Z = {
    "ring": 1.0,
    "wheel": 1.5,
    "plate": 2.0,
    "path": 2.5,
    "ground": 2.7,
    "link": 3.0,
    "block": 4.0,
    "pin": 6.0,
    "arrow": 7.0,
    "text": 9.0,
}
