"""Contact: ball, woodpecker, braking vehicle, dominoes, and a five-bar leg in steps of 1 ms.

The ball has a closed form; of the others `simulate` at rtol 1e-12 is the reference, which is thus
judged by itself there. Peers have the same masses, lengths and friction, read from mbody's model.
MuJoCo and Exudyn have no rigid contact: theirs is a spring and a damper that returns what Newton's
law of impact asks of a blow without friction; with shorter steps it is stiffer and a blow has more
of them, so that both errors fall. pymunk is rigid and has Newton's law. The woodpecker has the
restitution of the gallery, by Newton's law in place of Poisson's, which no peer has.

Each peer is tried with six settings of its contact, at one middle step of every scene; the most
exact one is raced at all steps, and stands in its name. What a peer is not asked is said in a row
without a time.

The leg is a hip on an upright guide, two cranks and two rods to the foot; a PD controller in Python
gives both torques every millisecond. Timed is the step with its inputs, not the controller. The
error is the greatest of all periods that are timed; the reference has ten steps a period, as a
single one of dop853 is exact to rounding here at any tolerance.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import statistics
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

import mbody
from benchmarks.frame import OURS, Engine, Row, Scope, Trial, available, race, sufficient_trial
from benchmarks.peers import ours
from benchmarks.planar import Box, Planar, planar
from mbody import Body, Contact, Gravity, Mechanism, Revolute, SimulationSettings

__all__ = ["TITLE", "measure"]

TITLE = "Contact: time to an error of the end, and the leg's time of a step of 1 ms with its error"
G, LEVELS = 9.81, (1e-3, 1e-6)
#: A round end sinks less than its radius [m/s, by the length of a blow] for Exudyn to see it.
SINKING = 1.0


def measure(scope: Scope) -> list[Row]:
    """Scenes in which errors at the end are asked, then the leg."""
    scenes = (ball(), woodpecker(), vehicle(), dominoes())
    return [*(row for scene in scenes for row in raced(scene, scope)), *leg(scope)]


class Scene(NamedTuple):
    """A motion: the number of steps of peers, which coordinates are compared at its end with what,
    and why some peers are not asked. Of a scene without plain numbers mbody alone is timed.
    """

    workload: str
    system: mbody.System
    until: float
    exact: np.ndarray
    compared: Any = np.s_[:, 2]
    plain: Planar | None = None
    counts: tuple[int, ...] = ()
    without: tuple[tuple[str, str], ...] = ()


def raced(scene: Scene, scope: Scope) -> list[Row]:
    """Whole calls of `simulate` beside all steps of a peer in one call."""

    def state(run: Any) -> tuple[np.ndarray, np.ndarray]:
        found = run_pose(run)[scene.compared]
        return found, found

    engines = [dataclasses.replace(ours.engine(scene.system, scene.until), state=state)]
    counts = scene.counts[:-2] if scope.short else scene.counts
    if scene.plain is not None and scene.plain.boxes:
        engines.append(by_impulses(scene, counts, engines[0]))
    engines += peers(scene, counts)
    size = np.abs(scene.exact).max() if scene.plain is None else 1.0

    def error(found: np.ndarray, _: np.ndarray) -> float:
        return off(found, scene.exact) / size

    rows = race("contacts", scene.workload, engines, error, scope, LEVELS)
    return [*rows, *(unstated(scene.workload, name, why) for name, why in scene.without)]


def unstated(workload: str, peer: str, why: str) -> Row:
    """A sentence in place of a time."""
    return Row("contacts", workload, f"{peer}: {why}", None, None, 0, None, setting=why)


def run_pose(run: Any) -> np.ndarray:
    """x, y and angle of all mass centres at the end."""
    histories = [run[body.name] for body in run.mechanism.bodies]
    return np.array([[one.x[-1], one.y[-1], one.angle[-1]] for one in histories])


def reference(system: mbody.System, until: float) -> np.ndarray:
    """By events at rtol 1e-12."""
    return run_pose(mbody.simulate(system, until, rtol=1e-12, instants=2))


def off(found: np.ndarray, exact: np.ndarray) -> float:
    """The greatest difference."""
    return float(np.abs(found - exact).max())


def by_impulses(scene: Scene, counts: Sequence[int], events: Engine) -> Engine:
    """mbody's other method."""

    def prepare(count: int) -> Callable[[], Any]:
        how = {"method": "moreau", "step": scene.until / count, "rtol": 1e-8, "instants": 2}
        return lambda: mbody.simulate(scene.system, scene.until, **how)

    return Engine(f"{OURS}, steps by impulses", counts, prepare, events.state)


# -- peers ------------------------------------------------------------------------------------


class Soft(NamedTuple):
    """A spring and a damper: a blow lasts so many steps in a motion of a thousand, else as the root
    of the step; without rebound it is damped critically, or so that a velocity is gone in a step.
    """

    steps: int
    deadbeat: bool

    def __str__(self) -> str:
        return f"blows of {self.steps} steps" + (", damped within one" if self.deadbeat else "")

    def lasting(self, step: float, until: float) -> float:
        """Seconds of a blow."""
        return self.steps * math.sqrt(1e-3 * until * step)

    def law(self, step: float, until: float, pulls: bool) -> Callable[[float], tuple[float, float]]:
        """Stiffness and damping a unit of mass, for a restitution."""
        rate = math.pi / self.lasting(step, until)

        def found(restitution: float) -> tuple[float, float]:
            if restitution:
                return rate**2, 2.0 * damping_ratio(restitution, pulls=pulls) * rate
            return rate**2, 1.0 / step if self.deadbeat else 2.0 * rate

        return found


class Rigid(NamedTuple):
    """A contact of pymunk: its iterations, and whether an overlap is gone in one step."""

    iterations: int
    at_once: bool

    def __str__(self) -> str:
        return f"{self.iterations} iterations" + (", overlaps gone at once" if self.at_once else "")


SOFT = tuple(Soft(*pair) for pair in itertools.product((6, 12, 24), (False, True)))
RIGID = tuple(Rigid(*pair) for pair in itertools.product((10, 30, 300), (False, True)))


def damping_ratio(restitution: float, *, pulls: bool = False) -> float:
    """Of a spring and damper that let go when their force is zero (Schwager and Pöschel, 2007), or
    that pull until the gap is zero.
    """
    if pulls:
        return -math.log(restitution) / math.hypot(math.pi, math.log(restitution))

    def returned(ratio: float) -> float:
        turn = math.sqrt(1.0 - ratio**2)
        angle = math.atan2(2.0 * ratio * turn, 1.0 - 2.0 * ratio**2)
        return math.exp(-ratio / turn * (math.pi - angle))

    low, high = 0.0, math.sqrt(0.5)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if returned(middle) > restitution else (low, middle)
    return low


def most_exact(choices: Iterable[Any], error: Callable[[Any], float]) -> Any:
    """The choice of the least error; one that fails has none."""

    def of(choice: Any) -> float:
        try:
            found = error(choice)
        except Exception:
            return math.inf
        return found if math.isfinite(found) else math.inf

    return min(choices, key=of)


def peers(scene: Scene, counts: Sequence[int]) -> list[Engine]:
    """Those that are installed and asked."""
    if scene.plain is None:
        return []
    kinds = [
        ("mujoco", "MuJoCo RK4", SOFT, mujoco_motion),
        ("pymunk", "pymunk", RIGID, pymunk_motion),
    ]
    if not scene.plain.boxes:
        kinds.append(("exudyn", f"Exudyn {exudyn_solver(scene.plain)}", SOFT, exudyn_motion))
    return [peer_engine(scene, counts, *kind) for module, *kind in kinds if available(module)]


def peer_engine(
    scene: Scene, counts: Sequence[int], name: str, choices: Sequence[Any], motion: Any
) -> Engine:
    """A peer with the most exact of its contacts."""

    def error(choice: Any) -> float:
        end = motion(scene, choice, counts[len(counts) // 2])()
        return off(end()[scene.compared], scene.exact)

    def state(pose: Callable[[], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        return pose()[scene.compared], pose()[scene.compared]

    choice = most_exact(choices, error)
    return Engine(f"{name}, {choice}", counts, functools.partial(motion, scene, choice), state)


#: Makes all steps; the pose at the end is read from what it gives.
Motion = Callable[[], Callable[[], np.ndarray]]


def mujoco_motion(scene: Scene, choice: Soft, count: int) -> Motion:
    import mujoco

    from benchmarks.peers.mujoco import model_of, pose_of, start_of

    assert scene.plain is not None
    tree, step = scene.plain.tree(), scene.until / count
    model = model_of(scene.plain, tree, step, law=choice.law(step, scene.until, False))
    data = start_of(scene.plain, tree, model)

    def run() -> Callable[[], np.ndarray]:
        mujoco.mj_step(model, data, nstep=count)
        return functools.partial(pose_of, scene.plain, tree, model, data)

    return run


def pymunk_motion(scene: Scene, choice: Rigid, count: int) -> Motion:
    """Steps in a loop of Python, as its users do."""
    assert scene.plain is not None
    space, bodies = pymunk_space(scene.plain, choice)
    step = scene.until / count

    def run() -> Callable[[], np.ndarray]:
        for _ in range(count):
            space.step(step)
        return lambda: np.array([[*body.position, body.angle] for body in bodies])

    return run


def pymunk_space(plain: Planar, choice: Rigid) -> tuple[Any, list[Any]]:
    from benchmarks.peers.pymunk import space_of

    space, bodies = space_of(plain, choice.iterations)
    if choice.at_once:
        space.collision_bias = 0.0
    return space, bodies


def exudyn_motion(scene: Scene, choice: Soft, count: int) -> Motion:
    from benchmarks.peers import exudyn

    assert scene.plain is not None
    made = exudyn_made(scene.plain, choice, scene.until / count, scene.until)
    made.system.Assemble()
    settings = exudyn.settings_of(scene.until, count)
    kind = exudyn_solver(scene.plain)

    def run() -> Callable[[], np.ndarray]:
        return exudyn.solve(made, settings, kind).coordinates

    return run


def exudyn_solver(plain: Planar) -> str:
    """Its explicit method of order 4 where there are no constraints."""
    return "TrapezoidalIndex2" if plain.pins or plain.held else "RK44"


def exudyn_made(plain: Planar, choice: Soft, step: float, until: float) -> Any:
    from benchmarks.peers import exudyn

    made = exudyn.made_of(plain)
    if plain.rims:
        radius = SINKING * choice.lasting(step, until)
        exudyn.touch(made, plain, choice.law(step, until, True), radius)
    return made


# -- scenes -----------------------------------------------------------------------------------

#: Radius of the ball, where it begins [m], what it returns.
RADIUS, HIGH, RETURNED = 0.1, 1.1, 0.8


def ball_at(instant: float) -> float:
    """Height of the centre in flight, by the closed form."""
    begin, speed = math.sqrt(2.0 * (HIGH - RADIUS) / G), math.sqrt(2.0 * G * (HIGH - RADIUS))
    if instant < begin:
        return HIGH - 0.5 * G * instant**2
    while True:
        speed *= RETURNED
        if instant < begin + 2.0 * speed / G:
            since = instant - begin
            return RADIUS + speed * since - 0.5 * G * since**2
        begin += 2.0 * speed / G


def floored(name: str, height: float = 0.0) -> Mechanism:
    """A level floor, and gravity."""
    floor = {"floor": {"line": {"point": "F"}}}
    machine = Mechanism(name, ground={"F": (0.0, height)}, ground_shapes=floor)
    machine.add(Gravity("g", y=-G))
    return machine


def ball() -> Scene:
    """Its height after three impacts, in flight."""
    machine, until = floored("ball"), 2.0
    shapes = {"rim": {"disc": "C", "radius": RADIUS}}
    machine.add(
        Body("ball", mass=1.0, inertia=0.004, points={"C": (0.0, 0.0)}, shapes=shapes),
        Contact("floor", "ground.floor", "ball.rim", restitution=RETURNED),
    )
    start = {"x": 0.0, "y": HIGH, "angle": 0.0, "vx": 0.0, "vy": 0.0, "omega": 0.0}
    machine.simulation = SimulationSettings(until=until, start={"ball": start})
    system = mbody.assemble(machine)
    return Scene(
        f"ball to {until:g} s",
        system,
        until,
        np.array([ball_at(until)]),
        np.s_[:, 1],
        planar(system),
        (2000, 20_000, 200_000, 2_000_000),
    )


def woodpecker() -> Scene:
    """Angles of its sleeve and bird after four impacts."""
    until, own = 0.3, mbody.gallery.path("woodpecker").read_text("utf-8")
    changed = own.replace('restitution = "e"', 'restitution = "e", law = "newton"')
    system = mbody.assemble(mbody.from_toml(changed))
    return Scene(
        f"woodpecker to {until:g} s",
        system,
        until,
        reference(system, until)[:, 2],
        plain=planar(system),
        counts=(3000, 30_000, 300_000, 1_000_000),
    )


def vehicle() -> Scene:
    """Where it stands at the end, as a part of its way."""
    system, until = mbody.assemble(mbody.gallery.load("braking_vehicle")), 3.0
    way = np.s_[:1, 0]
    why = "not tried: what sticks has another coefficient of friction than what slides, and brakes "
    why += "have a state"
    exact = reference(system, until)[way]
    return Scene(
        f"braking vehicle to {until:g} s", system, until, exact, way, without=(("all peers", why),)
    )


#: Width and height of a domino, and their distance [m].
WIDTH, HEIGHT, APART = 0.01, 0.05, 0.025


def dominoes() -> Scene:
    """Angles of four while the second falls, without rebound; stone rubs on stone."""
    machine, until, mass, friction = floored("dominoes"), 0.15, 0.02, 0.3
    inertia, w, h = mass * (WIDTH**2 + HEIGHT**2) / 12.0, 0.5 * WIDTH, 0.5 * HEIGHT
    corners = {"a": (-w, -h), "b": (w, -h), "c": (w, h), "d": (-w, h)}
    keys, start, count = ("x", "y", "angle", "vx", "vy", "omega"), {}, 4
    for n in range(count):
        shapes = {"s": {"polygon": list("abcd")}}
        machine.add(Body(f"d{n}", mass=mass, inertia=inertia, points=corners, shapes=shapes))
        rate = 0.0 if n else -6.0  # about its lower corner ahead
        state = (n * APART, h, 0.0, -rate * h, -rate * w, rate)
        start[f"d{n}"] = dict(zip(keys, state, strict=True))
    machine.add(
        mbody.Between("floor", "ground.floor", "d*.s", friction=friction),
        mbody.Between("stones", "d*.s", "d*.s", friction=friction),
    )
    machine.simulation = SimulationSettings(until=until, start=start)
    system = mbody.assemble(machine)
    plain = planar(system)
    plain.boxes = [Box(n, WIDTH, HEIGHT, friction) for n in range(count)]
    return Scene(
        f"{count} dominoes to {until:g} s",
        system,
        until,
        reference(system, until)[:, 2],
        plain=plain,
        counts=(75, 300, 1500, 7500, 75_000, 750_000),
        without=(
            ("Exudyn", "not asked: its contact has spheres and triangles, two boxes do not touch"),
        ),
    )


# -- leg --------------------------------------------------------------------------------------

#: Period of the controller [s], tolerance, gains [N m/rad, N m s/rad].
PERIOD, RTOL, STIFF, DAMPED = 1e-3, 1e-6, 60.0, 1.5
#: Distance of the cranks' axes, lengths of cranks and rods, the floor's height [m].
SPAN, CRANK, ROD, FLOOR = 0.1, 0.25, 0.4, -0.6
#: What the controller holds: angles of both cranks.
HELD = math.radians(225.0), math.radians(-45.0)
#: Steps that are not timed: the foot lands after 139 of them and the leg comes to rest.
LANDED = 500
#: Numbers of bodies: both cranks.
HIP, LEFT, RIGHT = 0, 1, 2

#: Angles and rates of both cranks give both torques.
Led = tuple[float, float, float, float]
#: Times of steps, and after each period the hip's height and the angles of the cranks.
Periods = tuple[np.ndarray, np.ndarray]


def leg_model(standing: bool, led: bool = True) -> Mechanism:
    """The leg above the floor; without the contact it falls on."""
    machine, half = floored("leg", FLOOR), 0.5 * SPAN
    ends = {"A": (-half, 0.0), "B": (half, 0.0)}
    machine.add(Body("hip", mass=3.0, inertia=0.05, points=ends, guess=(0.0, 0.0, 0.0)))
    for name, guess in {"l1": 225.0, "r1": -45.0, "l2": -54.0, "r2": 234.0}.items():
        mass, inertia, length = (0.4, 0.002, CRANK) if name[1] == "1" else (0.3, 0.004, ROD)
        points = {"I": (0.0, 0.0), "O": (length, 0.0)}
        own = {"mass": mass, "inertia": inertia, "cg": (0.5 * length, 0.0)}
        machine.add(Body(name, points=points, guess=math.radians(guess), **own))
    upright = [mbody.Marker(body, (0.0, 0.0), 0.5 * math.pi) for body in ("ground", "hip")]
    pins = {"A": ("hip.A", "l1.I"), "B": ("hip.B", "r1.I"), "K1": ("l1.O", "l2.I")}
    pins |= {"K2": ("r1.O", "r2.I"), "P": ("l2.O", "r2.O")}
    machine.add(mbody.Prismatic("guide", *upright))
    machine.add(*(Revolute(name, *ends) for name, ends in pins.items()))
    for name, crank in (("u1", "l1"), ("u2", "r1")) if led else ():
        machine.add(mbody.Input(name, "0 N*m"), mbody.Torque(f"t{name}", crank, "hip", value=name))
    if standing:
        machine.add(Contact("foot", "ground.floor", "l2.O", friction=0.8))
    return machine


@functools.cache
def leg_numbers(standing: bool) -> Planar:
    """The leg as peers have it."""
    return planar(mbody.assemble(leg_model(standing, led=False)))


def pd(led: Led) -> tuple[float, float]:
    """Torques on both cranks."""
    a1, a2, w1, w2 = led
    return -STIFF * (a1 - HELD[0]) - DAMPED * w1, -STIFF * (a2 - HELD[1]) - DAMPED * w2


def periods(
    read: Callable[[], Led],
    height: Callable[[], float],
    step: Callable[[float, float], Any],
    skipped: int,
    count: int,
) -> Periods:
    """Seconds of each step with its inputs, less those of reading the clock, and the states."""
    now = time.process_time_ns
    clock = min(-(now() - now()) for _ in range(1000))
    for _ in range(skipped):
        step(*pd(read()))
    spent, states = np.empty(count), np.empty((count, 3))
    for n in range(count):
        torques = pd(read())
        begin = now()
        step(*torques)
        spent[n] = now() - begin - clock
        states[n] = height(), *read()[:2]
    return 1e-9 * spent, states


def our_leg(
    standing: bool, skipped: int, count: int, parts: int = 1, *, method: str, rtol: float = RTOL
) -> Periods:
    """mbody, in so many steps a period."""
    sim = mbody.Simulator(leg_model(standing), rtol=rtol, method=method)
    inputs = sim.inputs

    def read() -> Led:
        one, other = sim["l1"], sim["r1"]
        return one.angle, other.angle, one.omega, other.omega

    def step(u1: float, u2: float) -> None:
        inputs["u1"], inputs["u2"] = u1, u2
        for _ in range(parts):
            sim.step(PERIOD / parts)

    step(*pd(read()))  # compiles and loads
    sim.reset()
    return periods(read, lambda: float(sim["hip"].y), step, skipped, count)


def mujoco_leg(
    standing: bool, skipped: int, count: int, parts: int, choice: Soft, *, how: str = "RK4"
) -> Periods:
    import mujoco

    from benchmarks.peers.mujoco import model_of, start_of

    plain, h = leg_numbers(standing), PERIOD / parts
    tree, law = plain.tree(), choice.law(h, 1e3 * h, False)
    model = model_of(plain, tree, h, how, law if standing else None)
    data = start_of(plain, tree, model)
    hip, left, right = (int(model.joint(name).qposadr[0]) for name in ("y0", "j1", "j2"))
    q, v, applied = data.qpos, data.qvel, data.qfrc_applied

    def read() -> Led:
        return float(q[left]), float(q[right]), float(v[left]), float(v[right])

    def step(u1: float, u2: float) -> None:
        applied[left], applied[right] = u1, u2
        mujoco.mj_step(model, data, nstep=parts)

    return periods(read, lambda: float(q[hip]), step, skipped, count)


def pymunk_leg(standing: bool, skipped: int, count: int, parts: int, choice: Rigid) -> Periods:
    space, bodies = pymunk_space(leg_numbers(standing), choice)
    hip, left, right = (bodies[n] for n in (HIP, LEFT, RIGHT))
    h = PERIOD / parts

    def read() -> Led:
        return left.angle, right.angle, left.angular_velocity, right.angular_velocity

    def step(u1: float, u2: float) -> None:
        for _ in range(parts):
            left.torque, right.torque = u1, u2  # forgotten after each step
            space.step(h)

    return periods(read, lambda: float(hip.position.y), step, skipped, count)


def exudyn_leg(standing: bool, skipped: int, count: int, parts: int, choice: Soft) -> Periods:
    """The controller is Exudyn's function before each step, the clock stops while it runs."""
    from exudyn import itemInterface as items

    from benchmarks.peers import exudyn

    h, cranks = PERIOD / parts, [LEFT, RIGHT]
    made = exudyn_made(leg_numbers(standing), choice, h, 1e3 * h)
    add = made.system.AddLoad  # the guide holds the hip against both torques
    loads = [
        add(items.LoadCoordinate(markerNumber=made.coordinate(b, 2), load=0.0)) for b in cranks
    ]
    made.system.Assemble()
    now, spent, states = time.process_time_ns, [], []
    begun, begin = -1, 0

    def before(system: Any, instant: float) -> bool:
        # by the step's end, as one that does not converge is repeated in halves
        nonlocal begun, begin
        period = math.ceil(instant / PERIOD - 0.01 / parts) - 1
        if period > begun:
            end = now()
            at, rate = made.coordinates(), made.coordinates(velocities=True)
            if period:
                spent.append(1e-9 * (end - begin))
                states.append([at[HIP, 1], *at[cranks, 2]])
            angles, rates = at[cranks, 2].tolist(), rate[cranks, 2].tolist()
            for load, u in zip(loads, pd((*angles, *rates)), strict=True):
                system.SetLoadParameter(load, "load", u)
            begun, begin = period, now()
        return True

    made.system.SetPreStepUserFunction(before)
    whole = skipped + count + 1  # the last is not seen
    exudyn.solve(made, exudyn.settings_of(PERIOD * whole, parts * whole))
    last = slice(skipped, skipped + count)
    return np.array(spent[last]), np.array(states[last])


def leg(scope: Scope) -> list[Row]:
    """In flight, then standing."""
    return [row for standing in (False, True) for row in leg_race(standing, scope)]


def leg_race(standing: bool, scope: Scope) -> list[Row]:
    """mbody by two methods, and peers in one and in more steps a period."""
    count, parts = (300, (1, 10)) if scope.short else (1000, (1, 2, 5, 10, 20, 50, 100))
    task = (standing, LANDED if standing else 0, count)
    exact = our_leg(*task, 10, method="dop853", rtol=1e-12)[1]
    calls: dict[str, Callable[[int], Periods]] = {
        OURS: functools.partial(our_leg, *task, method="dop853"),
        f"{OURS}, dopri5": functools.partial(our_leg, *task, method="dopri5"),
    }
    fast = functools.partial(mujoco_leg, how="implicitfast")
    for module, name, choices, call in (
        ("mujoco", "MuJoCo RK4", SOFT, mujoco_leg),
        ("mujoco", "MuJoCo implicitfast", SOFT, fast),
        ("pymunk", "pymunk", RIGID, pymunk_leg),
        ("exudyn", "Exudyn TrapezoidalIndex2", SOFT, exudyn_leg),
    ):
        if available(module):
            # in flight nothing touches, but iterations are those of pins as well
            tried = choices if standing or choices is RIGID else choices[:1]
            asked = functools.partial(call, *task)
            choice = most_exact(tried, lambda one, asked=asked: off(asked(10, one)[1], exact))
            said = f"{name}, {choice}" if len(tried) > 1 else name
            calls[said] = functools.partial(asked, choice=choice)
    workload = f"leg {'standing' if standing else 'in flight'}, a step of 1 ms"
    return leg_rows(workload, calls, parts, exact, scope)


def leg_rows(
    workload: str,
    calls: dict[str, Callable[[int], Periods]],
    parts: Sequence[int],
    exact: np.ndarray,
    scope: Scope,
) -> list[Row]:
    """Rows of one step a period, and of as many as give an error; mbody, the first, makes one. What
    is chosen runs in turn, round by round.
    """
    tried: dict[str, list[Trial]] = {}
    tails: dict[tuple[str, int], float] = {}

    def measured(name: str, n: int) -> tuple[float, float]:
        spent, states = calls[name](n)
        tails[name, n] = float(np.percentile(spent, 99.0))
        return float(np.median(spent)), off(states, exact)

    for name in calls:
        found = tried.setdefault(name, [])
        for n in parts[:1] if name.startswith(OURS) else parts:
            try:
                found.append(Trial(n, *measured(name, n)))
            except Exception as failure:
                scope.progress(f"    {name}, {n} steps a period: {str(failure)[:80]}")
    wanted = {f"{workload}, error {lv:.0e}": lv for lv in LEVELS} | {
        f"{workload}, no error asked": math.inf
    }
    chosen = {
        (label, name): sufficient_trial(found if level < math.inf else found[:1], level)
        for label, level in wanted.items()
        for name, found in tried.items()
    }
    for _ in range(min(3, scope.runs)):
        for name, found in tried.items():
            for trial in found:
                if any(one is trial for one in chosen.values()):
                    trial.times.append(measured(name, trial.setting)[0])
    rows = []
    for (label, name), trial in chosen.items():
        if trial is None:
            least = min((one.error for one in tried[name]), default=None)
            rows.append(Row("contacts", label, name, least, None, 0, None))
            continue
        ratio = statistics.median(a / b for a, b in zip(trial.times, tried[OURS][0].times))
        median, tail = statistics.median(trial.times), tails[name, trial.setting]
        said = f"{trial.setting} a period, 99 % below {1e6 * tail:.1f} µs"
        rows.append(
            Row("contacts", label, name, trial.error, median, len(trial.times), ratio, None, said)
        )
        scope.progress(f"  {label}, {name}: {1e6 * median:.1f} µs, {said}, error {trial.error:.1e}")
    return rows
