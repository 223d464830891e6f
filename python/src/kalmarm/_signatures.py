"""Signatures of compiled calls, for `inspect`, `help` and editors: nanobind has them as text alone."""

from __future__ import annotations

import __future__

import inspect
import re
from typing import Any

from . import _core


def _signature(function: Any) -> inspect.Signature:
    text, _, defaults = function.__nb_signature__[0]
    names: dict[str, Any] = {"defaults": defaults}
    text = re.sub(r"\\=?(\d+)", r"defaults[\1]", text)
    flags = __future__.annotations.compiler_flag  # annotations stay text
    exec(compile(f"{text}: ...", "<signature>", "exec", flags), names)
    return inspect.signature(names[function.__name__])


def _bound(method: Any) -> inspect.Signature:
    whole = _signature(method)
    return whole.replace(parameters=list(whole.parameters.values())[1:])


def install() -> None:
    """Of functions, methods and bound methods of this package's modules alone."""
    for one, signature in (
        (_core.instruction_set, _signature),
        (_core.Robot.forward_dynamics, _signature),
        (_core.ModelBuilder().build, _bound),
    ):
        _core._add_to_type_of(one, "__signature__", property(signature))
    _core.Frame.__signature__ = _bound(_core.Frame.__init__)  # type: ignore[attr-defined]
