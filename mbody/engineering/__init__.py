"""Engineering evaluations of a result, and analyses for special questions."""

from mbody.analysis.equilibria.equilibrium_curve import equilibrium_curve
from mbody.analysis.initial.close_loops import close_loops
from mbody.analysis.linear.linearize import linearize
from mbody.engineering.cam_limits import (
    CamAnalysis,
    CamPlace,
    CamUndercut,
    cam_analysis,
    cam_profile,
    cam_undercut,
)
from mbody.engineering.flywheel import (
    Fluctuation,
    FlywheelProof,
    FlywheelSizing,
    energy_fluctuation,
    fluctuation,
    flywheel,
    size_flywheel,
)
from mbody.engineering.force_balance import (
    ForceBalance,
    SpringBalance,
    force_balance,
    spring_balance,
)
from mbody.engineering.instant_centres import (
    Centrodes,
    InflectionCircle,
    InstantCentre,
    InstantCentres,
    MotionPolygon,
    PathCurvature,
    acceleration_polygon,
    centrodes,
    inflection_circle,
    instant_centres,
    path_curvature,
    velocity_polygon,
)
from mbody.engineering.internal_loads import (
    BearingLoad,
    InternalLoads,
    Stress,
    bearing_load,
    internal_loads,
)
from mbody.engineering.motor_sizing import (
    Indicator,
    MotorCurve,
    MotorSizing,
    indicator,
    motor_sizing,
)
from mbody.engineering.shaking import (
    BalanceShaft,
    Harmonics,
    RockingCouple,
    ShakingForce,
    ShakingOrders,
    balance_shafts,
    firing_angles,
    harmonics,
    rocking_couple,
    shaking_force,
    shaking_orders,
)
from mbody.solution.checks import momentum

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
