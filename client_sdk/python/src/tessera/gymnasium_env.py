"""An environment as Gymnasium has it, for what is written for that."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
from gymnasium.vector import AutoresetMode

if TYPE_CHECKING:
    from tessera.vector_env import Box, VectorEnv


class GymnasiumVectorEnv(gymnasium.vector.VectorEnv):  # type: ignore[misc]
    """A `tessera.VectorEnv` with Gymnasium's base class and spaces."""

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(self, env: VectorEnv) -> None:
        self.env = env
        self.num_envs = env.num_envs
        self.single_observation_space = _space(env.single_observation_space)
        self.single_action_space = _space(env.single_action_space)
        self.observation_space = _space(env.observation_space)
        self.action_space = _space(env.action_space)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """`options`: "reset_mask" [n], of the copies that are to be reset."""
        return self.env.reset(seed=seed, mask=(options or {}).get("reset_mask"))

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        return self.env.step(actions)

    def close(self, **kwargs: Any) -> None:
        self.env.close()


def _space(box: Box) -> Any:
    return gymnasium.spaces.Box(box.low, box.high, box.shape, box.dtype.type)
