"""Names and numbers as the page writes them."""

import math

from summary.points import Fit

TASKS = {
    "acceleration": "Acceleration a = M⁻¹(τ − bias)",
    "acceleration_batch": "Acceleration in batches, by the state",
    "inverse_dynamics": "Torque τ = M q̈ + bias",
    "inverse_dynamics_batch": "Torque in batches, by the state",
    "inverse": "Inverse M⁻¹",
    "inverse_batch": "Inverse in batches, by the state",
    "mass": "Mass matrix M",
    "mass_batch": "Mass matrix in batches, by the state",
    "inverse_triangle": "Inverse M⁻¹, one triangle",
    "mass_triangle": "Mass matrix M, one triangle",
    "solve_batch": "M⁻¹ τ in batches, by the state",
    "diagonal": "Diagonal of M⁻¹",
    "diagonal_batch": "Diagonal of M⁻¹ in batches, by the state",
    "operational": "J M⁻¹ Jᵀ of sites",
    "log_det": "log det M",
    "derivatives": "Derivatives of a with respect to q, q̇ and τ",
    "derivatives_batch": "Derivatives in batches, by the state",
    "frame": "Pose and Jacobian of the last body",
    "frame_batch": "Pose and Jacobian of the last body in batches, by the state",
    "momentum": "Centroidal momentum matrix",
    "momentum_batch": "Centroidal momentum matrix in batches, by the state",
    "jacobian_inverse_dynamics": "Inverse dynamics, τ − ID",
    "jacobian_forward_dynamics": "Forward dynamics, q̈ − M⁻¹(τ − bias)",
    "jacobian_innovations": "Whitened innovations, D^(−1/2)(I − L)(τ − ID)",
    "jacobian_mass_matrix": "Mass matrix",
    "random": "Random torques",
    "white": "White innovations",
    "consistent": "τ = M a",
    "free_fall": "Free fall",
    "dynamics": "Full dynamics",
    "factors": "Factors D and g",
}
MEASURES = {
    "relative": "relative error",
    "energy": "relative error in the energy norm",
    "scaled": "largest scaled entry error",
    "time": "time alone",
}
UNITS = {"years": 3.15576e16, "days": 8.64e13, "h": 3.6e12, "s": 1e9, "ms": 1e6, "µs": 1e3}  # ns

BYTES = {"GiB": 2**30, "MiB": 2**20, "KiB": 2**10}


def task_text(task: str) -> str:
    return TASKS.get(task, task)


def task_rank(task: str) -> tuple[int, str]:
    """Sorts the known tasks in their order, then others."""
    return list(TASKS).index(task) if task in TASKS else len(TASKS), task


def measure_text(measure: str) -> str:
    return MEASURES.get(measure, measure)


def time_text(nanoseconds: float | None) -> str:
    if nanoseconds is None:
        return "–"
    for unit, size in UNITS.items():
        if nanoseconds >= size:
            return f"{three_digits(nanoseconds / size)} {unit}"
    return f"{three_digits(nanoseconds)} ns"


def three_digits(value: float) -> str:
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def factor_text(ratio: float) -> str:
    """Of the other's time over ours."""
    if ratio >= 1:
        return f"{three_digits(ratio)} times faster"
    return f"{three_digits(1 / ratio)} times slower"


def rate_text(rate: float) -> str:
    return f"{three_digits(rate / 1e9)} GFLOP/s"


def bandwidth_text(rate: float) -> str:
    return f"{three_digits(rate / 1e9)} GB/s"


def bytes_text(count: float) -> str:
    for unit, size in BYTES.items():
        if count >= size:
            return f"{three_digits(count / size)} {unit}"
    return f"{count:.0f} bytes"


def error_text(value: float | None) -> str:
    if value is None:
        return "–"
    if value == 0:
        return "0"
    if not math.isfinite(value):
        return str(value)
    digits, exponent = f"{value:.1e}".split("e")
    return f"{digits}e{int(exponent)}"


def sentence(text: str) -> str:
    """As the page prints what a program said: a capital first, but in names, and a full stop."""
    first = text.split(maxsplit=1)[0] if text else ""
    named = any(letter.isdigit() or letter.isupper() for letter in first)
    return (text if named else text[:1].upper() + text[1:]) + ("" if text.endswith(".") else ".")


def thousands_text(value: float, digits: int = 3) -> str:
    """So many digits, and a narrow space between thousands."""
    return f"{float(f'{value:.{digits}g}'):,.10g}".replace(",", "\u202f")


def tolerance_text(tolerance: float) -> str:
    return f"{tolerance:g}".replace("e-0", "e-")


def share_text(share: float | None) -> str:
    """A share in per cent; a small one is never rounded to none, nor a large one to all."""
    if share is None:
        return "–"
    if 0 < share < 0.01:
        return "< 1 %"
    if 0.99 < share < 1:
        return "> 99 %"
    return f"{100 * share:.0f} %"


def fit_text(fit: Fit | None) -> str:
    return f"{fit.exponent:.2f} ± {fit.standard_error:.2f}".replace("-", "−") if fit else "–"
