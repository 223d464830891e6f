"""What editors and readers see: signatures, stubs, docstrings."""

import ast
import inspect
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import kalmarm

PUBLIC = [getattr(kalmarm, name) for name in kalmarm.__all__]
CALLS = {
    f"{one.__name__}.{name}": call
    for one in PUBLIC
    if inspect.isclass(one)
    for name, call in inspect.getmembers(one, callable)
    if not name.startswith("_") and str(getattr(call, "__module__", "")).startswith("kalmarm")
}
CALLS |= {one.__name__: one for one in PUBLIC if callable(one) and not inspect.isclass(one)}


def test_calls_were_found():
    assert {"Robot.forward_dynamics", "ImplicitStep.advance", "Factors.solve", "load"} <= set(CALLS)


@pytest.mark.parametrize("name", CALLS)
def test_every_public_call_has_a_signature_and_a_docstring(name):
    signature = inspect.signature(CALLS[name])
    assert all(one.annotation != one.empty for one in list(signature.parameters.values())[1:])
    assert inspect.getdoc(CALLS[name])


def test_signatures_of_compiled_calls_are_their_arguments(iiwa):
    signature = inspect.signature(iiwa.forward_dynamics)
    on_frames = ["forces", "axes", "loads", "gravity"]
    assert list(signature.parameters) == ["q", "qd", "tau", "out", "status", "threads", *on_frames]
    assert signature.parameters["threads"].default == 1
    assert signature.parameters["status"].kind == inspect.Parameter.KEYWORD_ONLY
    unbound = inspect.signature(kalmarm.Robot.forward_dynamics)
    assert list(unbound.parameters) == ["self", *signature.parameters]
    rotation = inspect.signature(kalmarm.Frame).parameters["rotation"]
    assert rotation.default == [1, 0, 0, 0]
    state = iiwa.random_state(0)
    bound = signature.bind(*state, threads=2)
    np.testing.assert_array_equal(
        iiwa.forward_dynamics(*bound.args, **bound.kwargs), iiwa.forward_dynamics(*state)
    )


def test_calls_take_forces_and_loads_alike():
    parameters = {name: inspect.signature(call).parameters for name, call in CALLS.items()}
    parameters["ImplicitStep"] = inspect.signature(kalmarm.ImplicitStep.__call__).parameters
    taking = {name: some for name, some in parameters.items() if "forces" in some}
    robots = ("forward_dynamics", "inverse_dynamics", "bias", "forward_dynamics_derivatives")
    steps = ("ImplicitStep", "ImplicitStep.acceleration", "ImplicitStep.derivatives")
    held = {"ConstrainedDynamics.forward_dynamics"}
    turning = {  # with their frames: in no other axes
        f"{of}_{way}"
        for of in ("Robot.forward_dynamics", "Robot.inverse_dynamics", "ImplicitStep.acceleration")
        for way in ("vjp", "jvp")
    }
    for name in turning:
        assert list(taking.pop(name))[-3:] == ["forces", "loads", "gravity"]
    assert set(taking) == {f"Robot.{name}" for name in robots} | set(steps) | held
    for name, some in taking.items():
        names = list(some)[list(some).index("forces") :]
        on_frames = ["forces", "axes", *([] if name in held else ["loads", "gravity"])]
        assert names in (on_frames, [*on_frames, "contacts"])
        assert {some[one].kind for one in names} == {inspect.Parameter.KEYWORD_ONLY}
        assert (some["forces"].default, some["axes"].default) == (None, "aligned")
    of_factors = ("solve", "factor", "inverse_mass_matrix", "diagonal", "log_det", "mass_matrix")
    loaded = {name for name, some in parameters.items() if "loads" in some}
    assert loaded >= (set(taking) - held) | {f"Robot.{name}" for name in (*of_factors, "gravity")}
    assert all(parameters[name]["loads"].default is None for name in loaded)


def test_stubs_say_what_a_call_returns():
    stub = ast.parse((Path(kalmarm.__file__).parent / "_core.pyi").read_text())
    named = {one.name for one in stub.body if isinstance(one, ast.ClassDef)}
    assert {"DynamicsError", "Factors", "Frame", "Model", "Plan", "Recommendation"} <= named
    (robot,) = (one for one in stub.body if isinstance(one, ast.ClassDef) and one.name == "Robot")
    returned = {}
    for call in robot.body:
        if isinstance(call, ast.FunctionDef):
            returned.setdefault(call.name, []).append(ast.unparse(call.returns))
    several = {name: results for name, results in returned.items() if len(results) > 1}
    array, outcomes = "NDArray[Any]", "tuple[NDArray[Any], NDArray[Any]]"
    derivatives = several.pop("forward_dynamics_derivatives")
    assert derivatives == ["Derivatives", "tuple[Derivatives, NDArray[Any]]"]
    for name in [name for name in several if name.endswith("_vjp")]:
        assert several.pop(name) == ["Gradients", "tuple[Gradients, NDArray[Any]]"]
    assert len(several) == 15
    assert all(results == [array, outcomes] for results in several.values())
    assert "Any" not in [result for results in returned.values() for result in results]


def test_stubs_are_those_of_the_compiled_module(tmp_path):
    """`scripts/test_python --stubs` makes them."""
    core = Path(__file__).parents[1] / "core"
    package = Path(kalmarm.__file__).parent
    made = tmp_path / "_core.pyi"
    command = ["-m", "nanobind.stubgen", "-q", "-m", "_core", "-p", core / "stubs.txt", "-o", made]
    environment = dict(os.environ, PYTHONPATH=str(package))
    subprocess.run([sys.executable, *command], env=environment, cwd=tmp_path, check=True)
    assert made.read_text() == (package / "_core.pyi").read_text()


def test_every_field_of_an_outcome_and_of_results_is_described():
    assert tuple(kalmarm.Outcome.__annotations__) == kalmarm.outcome_dtype.names
    for one in (
        kalmarm.Outcome, kalmarm.Derivatives, kalmarm.Gradients, kalmarm.OperationalSpace, kalmarm.Constraints,
        kalmarm.ConstrainedAcceleration, kalmarm.ConstrainedSolution, kalmarm.Impulse,
    ):  # fmt: skip
        for field in one.__annotations__:
            assert f"\n    {field}: " in one.__doc__
