"""Adam for small networks, without torch's compiler."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import torch

_BETAS = (0.9, 0.999)
_EPSILON = 1e-8
"""The defaults of torch.optim.Adam. Source: Kingma and Ba 2015, "Adam: A Method for Stochastic Optimization"."""
_STATE = ("step", "exp_avg", "exp_avg_sq")
"""Names of what is kept of each parameter, as torch.optim.Adam names them."""


class FusedAdam:
    """Takes the step of torch.optim.Adam for all parameters in one native call.

    The first optimizer of torch.optim loads torch's compiler, which takes 2 s of each training. This one has what
    Stable-Baselines3 asks of an optimizer, and its state is written as that of torch.optim.Adam.

    Args:
        parameters: To be optimized; each step takes their gradients.
        lr: Learning rate.
    """

    def __init__(self, parameters: Iterable[torch.Tensor], lr: float) -> None:
        self._parameters = tuple(parameters)
        self.param_groups: list[dict[str, Any]] = [{"lr": lr, "params": list(range(len(self._parameters)))}]
        """As in torch.optim; Stable-Baselines3 sets the learning rate there."""
        self._steps = [torch.zeros(()) for _ in self._parameters]
        self._means = [torch.zeros_like(each, requires_grad=False) for each in self._parameters]
        self._squares = [torch.zeros_like(each, requires_grad=False) for each in self._parameters]

    def zero_grad(self) -> None:
        """Forget the gradients."""
        for parameter in self._parameters:
            parameter.grad = None

    @torch.no_grad()
    def step(self) -> None:
        """Change all parameters against their gradients."""
        gradients = [parameter.grad for parameter in self._parameters if parameter.grad is not None]
        torch._foreach_add_(self._steps, 1)
        torch._fused_adam_(
            self._parameters,
            gradients,
            self._means,
            self._squares,
            [],
            self._steps,
            lr=self.param_groups[0]["lr"],
            beta1=_BETAS[0],
            beta2=_BETAS[1],
            weight_decay=0.0,
            eps=_EPSILON,
            amsgrad=False,
            maximize=False,
        )

    def state_dict(self) -> dict[str, Any]:
        """Return the learning rate, and of each parameter how often it was changed and both running means."""
        kept = zip(self._steps, self._means, self._squares, strict=True)
        state = {index: dict(zip(_STATE, each, strict=True)) for index, each in enumerate(kept)}
        return {"state": state, "param_groups": self.param_groups}

    @torch.no_grad()
    def load_state_dict(self, known: dict[str, Any], strict: bool = True) -> None:
        """Go on with what `state_dict` returned, here or of torch.optim.Adam; one without steps has no state."""
        del strict
        self.param_groups[0]["lr"] = known["param_groups"][0]["lr"]
        fresh = {name: torch.zeros(()) for name in _STATE}
        for index, own in enumerate(zip(self._steps, self._means, self._squares, strict=True)):
            state = known["state"].get(index, fresh)
            for name, tensor in zip(_STATE, own, strict=True):
                tensor.copy_(state[name])
