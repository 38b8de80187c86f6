"""Environments as Gymnasium has them: one, and many side by side."""

# mypy: disallow-any-unimported=False, disallow-subclassing-any=False

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from mbody.envs.task import Episodes, Task, Variable
from mbody.errors import ModelError, brief

Array = np.ndarray


RENDER_MODES = ("rgb_array",)


def _box(variables: Sequence[Variable]) -> Box:
    """The space of some numbers; float32 as agents have them."""
    low, high = (
        np.array([getattr(one, key) for one in variables], dtype=np.float32)
        for key in ("low", "high")
    )
    return Box(low, high, dtype=np.float32)


class MechanismEnv(gymnasium.Env[Array, Array]):
    """One mechanism as an environment; see `mbody.envs.make`.

    `sims`: Its motion, as number 0 of one.
    """

    def __init__(self, task: Task, render_mode: str | None = None) -> None:
        self.metadata = {"render_modes": [*RENDER_MODES], "render_fps": 1.0 / task.length}
        self.render_mode = _render_mode(render_mode)
        self._episodes = Episodes(task, 1)
        self.sims = self._episodes.sims
        self.action_space, self.observation_space = _box(task.actions), _box(task.observations)
        self._was_reset = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin an episode; see Gymnasium."""
        super().reset(seed=seed)
        self._episodes.begin(np.array([0]), [self.np_random])
        self._was_reset = True
        return self._episodes.observe()[0], {}

    def render(self) -> Any:
        """A picture of the present instant (height, width, 3), bytes, where `render_mode` is
        "rgb_array"; else None.
        """
        if self.render_mode is None:
            return None
        if not self._was_reset:
            raise ModelError("the environment has not begun: call reset before render")
        return self._episodes.picture(0)

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """One step; see Gymnasium."""
        if not self._was_reset:
            raise ModelError("the environment has not begun: call reset before step")
        given = _actions(action, (len(self._episodes.task.actions),))
        episodes = self._episodes
        episodes.step(given[None])
        failures = episodes.failures()
        info = {"failed": failures[0]} if failures else {}
        return (
            episodes.observe()[0],
            float(episodes.rewards[0]),
            bool(episodes.ended[0]),
            bool(episodes.truncated[0]),
            info,
        )


class MechanismVectorEnv(VectorEnv[Array, Array, Array]):
    """Many environments of one mechanism; see `mbody.envs.make_vec`."""

    def __init__(self, task: Task, num_envs: int, render_mode: str | None = None) -> None:
        self.render_mode = _render_mode(render_mode)
        self.metadata = {
            "render_modes": [*RENDER_MODES],
            "render_fps": 1.0 / task.length,
            "autoreset_mode": AutoresetMode.NEXT_STEP,
        }
        self._episodes = Episodes(task, num_envs)
        self.sims, self.num_envs = self._episodes.sims, num_envs
        self.single_action_space = _box(task.actions)
        self.single_observation_space = _box(task.observations)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._generators: list[np.random.Generator] = []
        self._over = np.zeros(num_envs, dtype=bool)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Array, dict[str, Any]]:
        """Begin all episodes, or those of ``options["reset_mask"]``; see Gymnasium. Environment k
        has the seed ``seed + k``.
        """
        seeds = list(seed) if isinstance(seed, Sequence) else [seed] * self.num_envs
        if isinstance(seed, int | np.integer):
            seeds = [int(seed) + k for k in range(self.num_envs)]
        if len(seeds) != self.num_envs:
            raise ModelError(
                f"reset: {len(seeds)} seeds for {self.num_envs} environments: give one number, or "
                "one for each"
            )
        mask = np.ones(self.num_envs, dtype=bool)
        if options is not None and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"])
            if mask.dtype != bool or mask.shape != (self.num_envs,):
                raise ModelError(
                    f"reset: reset_mask must be an array of {self.num_envs} bool, not {brief(mask)}"
                )
        if not self._generators:
            self._generators = [np_random(one)[0] for one in seeds]
        else:
            for k in np.flatnonzero(mask).tolist():
                if seeds[k] is not None:
                    self._generators[k] = np_random(seeds[k])[0]
        self._begin(np.flatnonzero(mask))
        return self._episodes.observe(), {}

    def render(self) -> Any:
        """Pictures of the present instants, one each, as of one environment."""
        if self.render_mode is None:
            return None
        if not self._generators:
            raise ModelError("the environments have not begun: call reset before render")
        return tuple(self._episodes.picture(k) for k in range(self.num_envs))

    def _begin(self, which: Array) -> None:
        if len(which):
            self._episodes.begin(which, [self._generators[k] for k in which.tolist()])
            self._over[which] = False

    def step(self, actions: Array) -> tuple[Array, Array, Array, Array, dict[str, Any]]:
        """One step of all; episodes that were over begin anew instead."""
        if not self._generators:
            raise ModelError("the environments have not begun: call reset before step")
        given = _actions(actions, (self.num_envs, len(self._episodes.task.actions)))
        episodes, over = self._episodes, self._over.copy()
        if over.any():
            self._begin(np.flatnonzero(over))
        episodes.step(given, ~over)
        self._over = episodes.ended | episodes.truncated
        info: dict[str, Any] = {}
        failures = episodes.failures()
        if failures:
            texts = np.full(self.num_envs, None, dtype=object)
            known = np.zeros(self.num_envs, dtype=bool)
            for k, why in failures.items():
                texts[k], known[k] = why, True
            info = {"failed": texts, "_failed": known}
        observed = episodes.observe()
        rewards, ends = episodes.rewards.copy(), episodes.ended.copy()
        return observed, rewards, ends, episodes.truncated.copy(), info


def _render_mode(given: str | None) -> str | None:
    if given not in (None, *RENDER_MODES):
        raise ModelError(
            f'render_mode is {brief(given)}: give "rgb_array", whose pictures any viewer of '
            "arrays shows, or None"
        )
    return given


def _actions(given: Any, shape: tuple[int, ...]) -> Array:
    """Actions as numbers."""
    try:
        found = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise ModelError(f"step: the action must be numbers, not {brief(given)}") from None
    if found.shape != shape:
        raise ModelError(
            f"step: the action has the shape {found.shape}, the environment takes {shape}: give a "
            "number for each input"
        )
    return found
