"""Cams that are analysed, and profiles for followers."""

from mbody import Body, CamFollower, Marker, Prismatic, gallery, kinematics, statics
from mbody.engineering import cam_analysis, cam_profile
from mbody.laws import Cam, Harmonic, Polynomial, Rise
from tests.errors.models import four_bar, tappet
from tests.errors.results import batch

LIFT = Cam(
    [Rise("3-4-5", 0.02, 0.0, 2.0), Rise("3-4-5", -0.02, 0.0, 2.0)], period=6.283185307179586
)


def of(joint=None, **more):
    return cam_analysis(kinematics(gallery.load("cam_follower")), joint, **more)


def made(*arguments, law=LIFT, **more):
    return lambda: cam_profile(law, *arguments, **more)


def two():
    machine = tappet(LIFT, base_radius=0.04)
    machine.add(
        Body("valve"),
        Prismatic("stem", Marker("ground", (0.0, 0.0), 1.0), Marker("valve", (0.0, 0.0), 1.0)),
        CamFollower("lobe", "shaft", "valve", LIFT, base_radius=0.04),
    )
    return machine


SCENARIOS = {
    "one of two cams": lambda: cam_analysis(kinematics(two())),
    "a cam of a four-bar": lambda: cam_analysis(kinematics(four_bar())),
    "a cam that is not there": lambda: of("cam"),
    "a cam at rest": lambda: cam_analysis(statics(gallery.load("cam_follower"))),
    "a cam of a batch": lambda: cam_analysis(batch()),
    "a limit beyond a right angle": lambda: of(limit="120 deg"),
    "a contour of two points": lambda: of().contour(2),
    "a profile without a base circle": made(0.0),
    "a profile for an arm without a place": made(0.04, arm=0.1),
    "a profile for a guide that misses its cam": made(0.04, offset=0.05),
    "a profile for an arm that is too short": made(0.04, arm=0.01, centre_distance=0.1),
    "a profile that a follower outruns": made(
        0.01, law=Harmonic(2.0, 2.0, 3.0), arm=0.1, centre_distance=0.1
    ),
    "a profile that does not close": made(0.04, law=Polynomial([0.0, 0.001])),
}
