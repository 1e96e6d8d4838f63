"""Adam for small networks, without torch's compiler."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import torch

_BETAS = (0.9, 0.999)
"""Decay rates as in torch.optim.Adam. Source: Kingma and Ba 2015, "Adam: A Method for Stochastic Optimization"."""
_STATE = ("step", "exp_avg", "exp_avg_sq")
"""Names of the state of each parameter, as in torch.optim.Adam."""


class FusedAdam:
    """Takes the step of torch.optim.Adam for all parameters in one native call.

    The first optimizer of torch.optim that is created loads torch's compiler, which takes 2 s of each training. This
    class has the interface that Stable-Baselines3 needs from an optimizer, and its state has the format of
    torch.optim.Adam.

    Args:
        parameters: Parameters to optimize; each step uses their gradients.
        lr: Learning rate.
        eps: Small number that keeps a step finite where no gradient was seen.
    """

    def __init__(self, parameters: Iterable[torch.Tensor], lr: float, eps: float = 1e-8) -> None:
        self._parameters, self._eps = tuple(parameters), eps
        self.param_groups: list[dict[str, Any]] = [{"lr": lr, "params": list(range(len(self._parameters)))}]
        """Format as in torch.optim; Stable-Baselines3 sets the learning rate here."""
        self._steps = [torch.zeros(()) for _ in self._parameters]
        self._means = [torch.zeros_like(each, requires_grad=False) for each in self._parameters]
        self._squares = [torch.zeros_like(each, requires_grad=False) for each in self._parameters]

    def zero_grad(self) -> None:
        """Reset the gradients."""
        for parameter in self._parameters:
            parameter.grad = None

    @torch.no_grad()
    def step(self) -> None:
        """Update all parameters by their gradients; parameters without a gradient stay unchanged."""
        rows = [row for row, parameter in enumerate(self._parameters) if parameter.grad is not None]
        gradients = [gradient for parameter in self._parameters if (gradient := parameter.grad) is not None]
        steps = [self._steps[row] for row in rows]
        torch._foreach_add_(steps, 1)
        torch._fused_adam_(
            [self._parameters[row] for row in rows],
            gradients,
            [self._means[row] for row in rows],
            [self._squares[row] for row in rows],
            [],
            steps,
            lr=self.param_groups[0]["lr"],
            beta1=_BETAS[0],
            beta2=_BETAS[1],
            weight_decay=0.0,
            eps=self._eps,
            amsgrad=False,
            maximize=False,
        )

    def state_dict(self) -> dict[str, Any]:
        """Return the learning rate, and the number of updates and both running means of each parameter."""
        kept = zip(self._steps, self._means, self._squares, strict=True)
        state = {index: dict(zip(_STATE, each, strict=True)) for index, each in enumerate(kept)}
        return {"state": state, "param_groups": self.param_groups}

    @torch.no_grad()
    def load_state_dict(self, known: dict[str, Any], strict: bool = True) -> None:
        """Restore the state from `state_dict`, of this class or of torch.optim.Adam; missing state is zero."""
        del strict
        self.param_groups[0]["lr"] = known["param_groups"][0]["lr"]
        fresh = {name: torch.zeros(()) for name in _STATE}
        for index, own in enumerate(zip(self._steps, self._means, self._squares, strict=True)):
            state = known["state"].get(index, fresh)
            for name, tensor in zip(_STATE, own, strict=True):
                tensor.copy_(state[name])
