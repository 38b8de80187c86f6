"""Engineering evaluations of a result, and analyses for special questions."""

from mbody.analysis.equilibria.equilibrium_curve import equilibrium_curve
from mbody.analysis.initial.close_loops import close_loops
from mbody.analysis.linear.linearize import linearize
from mbody.engineering.bearing_loads import BearingLoad, bearing_load
from mbody.engineering.cam_limits import CamAnalysis, CamPlace, cam_analysis
from mbody.engineering.cam_profile import CamUndercut, cam_profile, cam_undercut
from mbody.engineering.fluctuation import Fluctuation, energy_fluctuation, fluctuation
from mbody.engineering.flywheel import FlywheelProof, FlywheelSizing, flywheel, size_flywheel
from mbody.engineering.force_balance import ForceBalance, force_balance
from mbody.engineering.harmonics import Harmonics, harmonics
from mbody.engineering.indicator import Indicator, indicator
from mbody.engineering.instant_centres import (
    Centrodes,
    InstantCentre,
    InstantCentres,
    centrodes,
    instant_centres,
)
from mbody.engineering.internal_loads import InternalLoads, Stress, internal_loads
from mbody.engineering.motion_polygons import MotionPolygon, acceleration_polygon, velocity_polygon
from mbody.engineering.motor_sizing import MotorCurve, MotorSizing, motor_sizing
from mbody.engineering.path_curvature import (
    InflectionCircle,
    PathCurvature,
    inflection_circle,
    path_curvature,
)
from mbody.engineering.shaking import (
    BalanceShaft,
    RockingCouple,
    ShakingForce,
    ShakingOrders,
    balance_shafts,
    firing_angles,
    rocking_couple,
    shaking_force,
    shaking_orders,
)
from mbody.engineering.spring_balance import SpringBalance, spring_balance
from mbody.solution.balances import momentum

__all__ = [
    "CamAnalysis", "CamPlace", "cam_analysis", "cam_profile", "cam_undercut", "CamUndercut",
    "motor_sizing", "MotorSizing", "MotorCurve", "bearing_load", "BearingLoad", "internal_loads",
    "Stress", "InternalLoads", "size_flywheel", "FlywheelSizing", "FlywheelProof",
    "shaking_orders", "balance_shafts", "ShakingOrders", "BalanceShaft", "rocking_couple",
    "RockingCouple", "harmonics", "Harmonics", "firing_angles", "Centrodes", "Fluctuation",
    "ForceBalance", "Indicator", "InflectionCircle", "InstantCentre", "InstantCentres",
    "MotionPolygon", "PathCurvature", "ShakingForce", "SpringBalance", "acceleration_polygon",
    "centrodes", "close_loops", "energy_fluctuation", "equilibrium_curve", "fluctuation",
    "flywheel", "force_balance", "indicator", "inflection_circle", "instant_centres", "linearize",
    "momentum", "path_curvature", "shaking_force", "spring_balance", "velocity_polygon",
]  # fmt: skip
