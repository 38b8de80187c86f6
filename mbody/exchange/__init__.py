"""Exchange: models from other programs' files, and drawings of links and cams for CAD."""

from mbody.exchange.imported import Imported
from mbody.exchange.recognition import import_model

__all__ = ["Imported", "import_model"]
