"""Exchange: models from other programs' files, and drawings of links and cams for CAD."""

from mbody.exchange.dxf import PartDrawing, to_dxf
from mbody.exchange.imported import Imported
from mbody.exchange.recognition import import_model

__all__ = ["Imported", "PartDrawing", "import_model", "to_dxf"]
