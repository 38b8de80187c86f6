"""`make` and `make_vec`: environments of Gymnasium by what they measure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mbody.analysis.position.assembly_analysis import as_system
from mbody.envs.task import Task, task
from mbody.errors import ModelError
from mbody.files.model import load
from mbody.gallery import model_path
from mbody.model.mechanism import Mechanism
from mbody.quantities.formula import Number
from mbody.system.system import System

if TYPE_CHECKING:
    from mbody.envs.gymnasium_envs import MechanismEnv, MechanismVectorEnv


#: What a measure is, or several with names or bounds.
Measures = str | Sequence[Any] | Mapping[str, Any]


def make(
    model: Mechanism | System | str | Path,
    *,
    actions: Mapping[str, tuple[Number, Number]],
    observations: Measures,
    reward: str | Mapping[str, float],
    step: Number,
    frame_skip: int = 1,
    terminated: str | Sequence[str] = (),
    max_steps: int | None = None,
    reset: Mapping[str, tuple[Number, Number]] | None = None,
    method: str | None = None,
    rtol: float | None = None,
    atol: float | None = None,
    render_mode: str | None = None,
) -> MechanismEnv:
    """An environment of Gymnasium of one mechanism.

    Parameters
    ----------
    model : Mechanism, System, str or Path
        A description, its file, or a name of the gallery, such as ``"cart_pole"``.
    actions : mapping
        Inputs of the mechanism by name, each with its lowest and highest value; an action beyond
        them is cut.
    observations : list or mapping
        Measures such as ``"pole.angle"``, or by name, ``{"angle": "pole.angle"}``; with bounds
        ``("pole.angle", -1.0, 1.0)``, within which it is cut. Angles are in rad.
    reward : str or mapping
        A measure at the end of each step, or measures with their weights,
        ``{"pole.angle^2": -1.0, "u^2": -0.01}``, each in the units of the mechanism.
    step : float or str
        Time of a step [time]; `frame_skip` of them make a step of the environment, in which actions
        stay the same.
    terminated : str or list of str
        Relations that end an episode, ``"abs(pole.angle) > 24 deg"``, looked at when a step of the
        environment is over. A motion that fails ends it too; ``info["failed"]`` says why.
    max_steps : int, optional
        Steps of the environment after which an episode is truncated.
    reset : mapping, optional
        Places, rates and auxiliary states by name that begin at random, evenly between two values:
        ``{"pole.angle": ("-3 deg", "3 deg")}``. All else is as the mechanism begins, as near to it
        as the loops allow.
    method, rtol, atol
        As of `Simulators`.
    render_mode : str, optional
        "rgb_array": `env.render()` is a picture (height, width, 3) of the present instant, all of
        one size and scale; needs matplotlib.

    Returns
    -------
    gymnasium.Env
        With ``env.sims``, the `Simulators` of one motion.

    Raises
    ------
    ModelError
        For what the mechanism has not; and where Gymnasium is not installed.

    Examples
    --------
    >>> import mbody
    >>> env = make(
    ...     "cart_pole",
    ...     actions={"u": ("-10 N", "10 N")},
    ...     observations=["cart.x", "pole.angle"],
    ...     reward={"pole.angle^2": -1.0},
    ...     step="20 ms",
    ... )
    >>> env.reset(seed=1)[0].shape
    (2,)
    """
    own = _task(model, locals())
    _gymnasium()
    from mbody.envs.gymnasium_envs import MechanismEnv

    return MechanismEnv(own, render_mode)


def make_vec(
    model: Mechanism | System | str | Path,
    num_envs: int,
    *,
    actions: Mapping[str, tuple[Number, Number]],
    observations: Measures,
    reward: str | Mapping[str, float],
    step: Number,
    frame_skip: int = 1,
    terminated: str | Sequence[str] = (),
    max_steps: int | None = None,
    reset: Mapping[str, tuple[Number, Number]] | None = None,
    method: str | None = None,
    rtol: float | None = None,
    atol: float | None = None,
    threads: int | None = None,
    render_mode: str | None = None,
) -> MechanismVectorEnv:
    """Many environments of one mechanism side by side, on lanes: a vector environment of Gymnasium.

    Its number k gives, to the last bit, what `make` gives with the seed ``seed + k``. An episode
    that is over begins anew in the next step, whose action is not used and whose reward is 0
    (``AutoresetMode.NEXT_STEP``, Gymnasium's own default).

    Parameters
    ----------
    num_envs : int
    threads : int, optional
        As of `Simulators`.
    model, actions, observations, reward, step, frame_skip, terminated, max_steps, reset, method, \
rtol, atol, render_mode
        As of `make`.

    Returns
    -------
    gymnasium.vector.VectorEnv
        With ``envs.sims``, the `Simulators`.

    Raises
    ------
    ModelError
        As `make`.

    Examples
    --------
    >>> import mbody
    >>> envs = make_vec(
    ...     mbody.gallery.path("cart_pole"),
    ...     8,
    ...     actions={"u": ("-10 N", "10 N")},
    ...     observations=["cart.x", "pole.angle"],
    ...     reward={"pole.angle^2": -1.0},
    ...     step="20 ms",
    ... )
    >>> envs.reset(seed=1)[0].shape
    (8, 2)
    """
    given = locals()
    own = _task(model, given)
    own.options["threads"] = threads
    _gymnasium()
    from mbody.envs.gymnasium_envs import MechanismVectorEnv

    return MechanismVectorEnv(own, num_envs, render_mode)


def _task(model: Any, given: Mapping[str, Any]) -> Task:
    if isinstance(model, str | Path):
        model = load(model_path(str(model)))
    return task(
        as_system(model),
        given["actions"],
        given["observations"],
        given["reward"],
        given["step"],
        given["frame_skip"],
        given["terminated"],
        given["max_steps"],
        given["reset"],
        {name: given[name] for name in ("method", "rtol", "atol")},
    )


def _gymnasium() -> None:
    try:
        import gymnasium  # noqa: F401
    except ImportError:
        raise ModelError(
            "environments need Gymnasium, which is not installed: pip install 'mbody-planar[gym]'"
        ) from None
