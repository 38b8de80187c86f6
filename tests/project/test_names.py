"""A name of a file or a class says once what it means."""

import re
from collections import defaultdict

from tests.support.paths import ROOT

PACKAGE = ROOT / "mbody"

#: Folders that are the meaning of what is in them: `cli/analyse.py` is the command of `simulate`,
#: `summaries/analyses.py` the summary of `modes`, `engines/pinocchio/dynamics.py` the motion there.
MEANINGS = ("cli", "files", "summaries", "model/joints", "model/loads")
ENGINES = ("mjcf", "mujoco", "oracle", "pinocchio", "pymunk")
EXEMPT = {*MEANINGS, *(f"engines/{name}" for name in ENGINES)}


def test_a_file_name_recurs_only_where_its_folder_is_its_meaning():
    places = defaultdict(list)
    for path in PACKAGE.rglob("*.py"):
        folder = path.parent.relative_to(PACKAGE).as_posix()
        if path.name != "__init__.py" and folder not in EXEMPT:
            places[path.name].append(folder)
    assert not {name: found for name, found in places.items() if len(found) > 1}


def test_a_class_has_a_name_of_its_own():
    places = defaultdict(list)
    for path in PACKAGE.rglob("*.py"):
        for name in re.findall(r"^class (\w+)", path.read_text("utf-8"), re.MULTILINE):
            places[name].append(path.relative_to(PACKAGE).as_posix())
    assert len(places) > 500
    assert not {name: found for name, found in places.items() if len(found) > 1}
