"""The style of all pictures: colours, widths and sizes.

The colours are from the palette of M. Okabe and K. Ito, which colour-blind people can distinguish;
they also differ in lightness, so that they can be distinguished in print.
"""

from __future__ import annotations

__all__ = ["CURVES", "FONTS", "MATHS", "SIZE", "SOFT", "Z"]

INK = "#26323f"  # outlines of links, pins, text
LINK = "#dde5ec"  # fill of links
PLATE = "#eaeff4"  # fill of plates
WHEEL = "#f3f6f9"  # behind the links
GROUND = "#59636e"  # supports, rails, hatching
SOFT = "#7d8894"  # paths, scales, remarks
LOAD = "#d55e00"
FORCE = "#0072b2"
DRIVE = "#00795a"
POLE = "#8f2d6b"
PAPER = "#ffffff"

#: Curves of a plot, in this order; the dashes distinguish them without colours.
CURVES = (
    ("#0072b2", "-"),
    ("#d55e00", (0, (6, 1.5))),
    ("#00795a", (0, (4, 1.2, 1.2, 1.2))),
    ("#26323f", (0, (1.4, 1.2))),
    ("#cc79a7", (0, (8, 1.5, 1.5, 1.5, 1.5, 1.5))),
    ("#e69f00", (0, (2.5, 1))),
)

#: Both are part of matplotlib, so that a picture is the same on every machine.
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

#: Layers, from bottom to top.
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
