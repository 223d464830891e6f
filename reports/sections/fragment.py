"""Code that does what is advised, for the page."""

import json
import shlex

TOLERANCES = {
    "Ladder<default>": "",
    "Ladder<last_bits>": ", {.tolerance = kalmarm::last_bits}",
}
SCALARS = {"float32": "float", "float64": "double"}
CALLS = {
    "acceleration": ("qd(robot.nv()), tau(qd), a(qd)", "forward_dynamics(q, qd, tau, a)"),
    "inverse": ("X(robot.nv() * robot.nv())", "inverse_mass(q, X)"),
}
ROWS = 1024
CALLS_OF_ROWS = {
    "acceleration_batch": (
        "qd(rows * robot.nv()), tau(qd), a(qd)",
        "forward_dynamics(q, qd, tau, a, outcomes)",
    ),
    "inverse_batch": ("X(rows * robot.nv() * robot.nv())", "inverse_mass(q, X, outcomes)"),
}


def fragment(
    name: str, file: str, load_options: str, task: str, variant: str, precision: str
) -> str:
    """Ten lines of C++ by the door, or `evaluate` where the door has no such variant."""
    calls = CALLS | CALLS_OF_ROWS
    if variant not in TOLERANCES or precision not in SCALARS or task not in calls:
        first = ["build/bin/evaluate", name, "--variant", variant]
        second = ["--precision", precision, "--want", task, "--out", f"{name}.json"]
        return f"{shlex.join(first)} \\\n    {shlex.join(second)}"
    scalar = SCALARS[precision]
    literal = json.dumps(file, ensure_ascii=False)  # escapes of JSON are escapes of C++
    load = literal + (f", {load_options}" if load_options else "")
    vectors, call = calls[task]
    states = f"""\
  std::vector<{scalar}> q(file.home.begin(), file.home.end());
  std::vector<{scalar}> {vectors};
  return robot.{call} ? 0 : 1;"""
    if task in CALLS_OF_ROWS:
        states = f"""\
  const int rows = {ROWS};
  std::vector<{scalar}> q(rows * robot.nq()), {vectors};
  std::vector<kalmarm::Outcome> outcomes(rows);
  return robot.{call};"""
    return f"""\
#include <kalmarm/dynamics.hpp>
#include <kalmarm/load.hpp>
#include <vector>
int main() {{
  const auto file = kalmarm::load_robot({load});
  kalmarm::Dynamics<{scalar}> robot(file.model{TOLERANCES[variant]});
{states}
}}"""
