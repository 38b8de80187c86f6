"""Exchange: models from other programs' files, and drawings of links and cams for CAD."""

from mbody.exchange.dxf import PartDrawing, to_dxf
from mbody.exchange.imported import Imported
from mbody.exchange.recognition import import_model, other_program

__all__ = ["Imported", "PartDrawing", "import_model", "other_program", "to_dxf"]
