"""The pictures of docs/pictures, which the README and docs/gallery.md show, drawn anew.

``make pictures`` (``python -m tests.pictures``) does it for every model that the gallery has, with
a film and a free-body diagram of the textbook's four-bar.
"""

import mbody
from mbody import gallery
from mbody.analysis.driven.driven import analyse_at
from mbody.model.simulation import Instants
from mbody.views import draw, save
from mbody.views.free_bodies import draw_free_bodies
from mbody.views.shapes import motion
from tests.support.linkage_sheet import linkage_sheet
from tests.support.paths import ROOT

FOLDER = ROOT / "docs" / "pictures"

#: Pictures beside these, of searches that take too long to repeat; documents show them.
KEPT = {
    "dwell.svg": "optimization.md",
    "drawing_board.png": "tutorial/drawing_board.md",
    "rod_inside.svg": "engines.md",
}
#: What is shown beside the instant that the model requests: an instant, paths, joint forces.
SHOWN = {
    "double_pendulum": {"after": 1.0},
    "free_fourbar": {"after": 0.5},
    "cam_follower": {"at": {"shaft": "130 deg"}},
    "flyball_governor": {"at": {"arm_l": "60 deg"}},
    "geneva_drive": {"after": 0.1},
    "hoekens": {"paths": ["coupler.P"]},
    "mud_pump": {"at": {"crank": "60 deg"}},
    "mud_pump_motor": {"after": 9.75},
    "norton_fourbar": {"forces": True},
    "peaucellier": {"at": {"crank": "60 deg"}, "paths": ["QA.Q"]},
    "planetary_train": {"at": {"sun": "90 deg"}},
    "quick_return": {"at": {"crank": "20 deg"}},
    "scissor_lift": {"at": {"t": 5.0}},
    "static_fourbar": {"forces": True},
    "stephenson_sixbar": {"at": {"crank": "120 deg"}, "paths": ["coupler.P"]},
    "toggle_press": {"at": {"t": 7.0}, "forces": True},
    "watt_sixbar": {"at": {"crank": "60 deg"}},
}


def picture(name):
    """The picture of a model of the gallery."""
    shown, machine = SHOWN.get(name, {}), gallery.load(name)
    if machine.ask is None:
        run = mbody.simulate(machine, times=[shown.get("after", 0.0)])
    else:
        run = analyse_at(
            machine, "kinetostatics", Instants(at=shown["at"]) if "at" in shown else None
        )
    return draw(run, forces=shown.get("forces", False), paths=shown.get("paths", ()))


def film(folder):
    """The textbook's four-bar in motion, with its forces; the name of the file."""
    shown = ("names", "forces", "paths", "centres")
    run = motion(gallery.load("norton_fourbar"))
    mbody.animate(run, folder / "fourbar.gif", duration=4.0, rate=14.0, width=480, show=shown)
    return "fourbar.gif"


def diagram(folder):
    """A link of it alone, with its force polygon; the name of the file."""
    run = mbody.kinetostatics(gallery.load("norton_fourbar"))
    save(draw_free_bodies(run, ["coupler"], headed=False), folder / "coupler.svg")
    return "coupler.svg"


def polygons(folder):
    """The instant centres and polygons of a slotted lever; the name of the file."""
    run = mbody.kinematics(gallery.load("quick_return"), [0.1])
    save(draw(run, poles=True, polygons=True), folder / "polygons.svg")
    return "polygons.svg"


def make(folder):
    """Write all pictures into a folder; their names."""
    for name in gallery.names():
        save(picture(name), folder / f"{name}.svg")
    made = [film(folder), diagram(folder), polygons(folder), linkage_sheet(folder)]
    return sorted([*made, *(f"{name}.svg" for name in gallery.names())])


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    made = make(FOLDER)
    for old in FOLDER.iterdir():
        if old.name not in made and old.name not in KEPT:
            old.unlink()
    print(f"wrote {len(made)} pictures to {FOLDER.relative_to(ROOT)}, mbody {mbody.__version__}")
