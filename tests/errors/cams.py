"""Cams that are analysed, and profiles for followers."""

from mbody import Body, CamFollower, Marker, Prismatic, gallery, kinematics, statics
from mbody.engineering import cam_analysis, cam_profile
from mbody.laws import Cam, Harmonic, Polynomial, Rise
from tests.errors.models import four_bar, tappet

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

SENTENCES = r"""
one of two cams | ModelError | - | 'tappet' has 2 cams ('contact', 'lobe'): name the joint of one
a cam of a four-bar | ModelError | - | 'four-bar' has no cam: there is no joint of the type CamFollower in it
a cam that is not there | ModelError | cam | there is no cam 'cam' (there are: 'contact')
a cam at rest | ModelError | - | a cam is of a motion, and statics computes no velocities: use kinematics
a limit beyond a right angle | ModelError | contact | the limit of the pressure angle of 'contact' is above 0 and below 90 deg, not 120 deg
a contour of two points | ModelError | - | a contour has 4 to 1000000 points, not '2'
a profile without a base circle | ModelError | - | a cam has a base circle above 0 and a roller from 0 on, not 0 and 0
a profile for an arm without a place | ModelError | - | a follower on an arm has an arm and a centre_distance: give both
a profile for a guide that misses its cam | ModelError | - | a guide at the offset 0.05 passes the pitch circle of 0.04: give a smaller offset, or a greater base_radius
a profile for an arm that is too short | ModelError | - | an arm of 0.01 at the distance 0.1 does not reach a pitch circle of 0.04: give an arm between 0.06 and 0.14
a profile that a follower outruns | ModelError | - | near 299.8 deg the follower runs around the cam faster than it turns: give a smaller lift, or a greater base_radius
a profile that does not close | ModelError | - | the lift does not close: 0 at 0 deg, 0.00628319 at 360 deg: give a law that repeats after one turn
"""
