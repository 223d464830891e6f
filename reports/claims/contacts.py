"""Whether square roots keep float32's digits beside contacts of any stiffness: C12."""

import math
from collections import defaultdict
from statistics import median

from claims.claim import CHOLESKY, GIVENS, MGS, RISING, Check, Claim, Plot, within
from read.data import Data
from read.stress import U

PRECISION = "float32"
ARRAYS = (MGS, GIVENS, "Sequential<ArrayHouseholder>")


def contacts(data: Data) -> Claim:
    """C12. Float32, robots that stand. For every robot and stiffness the median error of H^-1 b by
    an array, a refusal being infinitely wrong, is at most 100 u: by Gram-Schmidt, by rotations and
    by reflections."""
    found = defaultdict(list)
    for it in data.contact_errors:
        if it.precision == PRECISION and it.variant in (*ARRAYS, CHOLESKY):
            error = math.inf if it.error is None else it.error
            found[it.variant, it.scene, it.stiffness].append(error)
    medians = {key: median(own) for key, own in found.items()}
    rows = [
        {
            "scene": scene,
            "task": "contacts",
            "variant": variant,
            "precision": PRECISION,
            "x": stiffness,
            "error": error if math.isfinite(error) else None,
            "share": sum(map(math.isinf, found[variant, scene, stiffness]))
            / len(found[variant, scene, stiffness]),
            "seeds": len(found[variant, scene, stiffness]),
        }
        for (variant, scene, stiffness), error in medians.items()
    ]
    return Claim(
        "C12",
        "Square roots and contacts",
        "Square roots keep float32’s digits under any contact stiffness: the median error of "
        "(M + JᵀDJ)⁻¹b by an array stays below 100 u, whichever orthogonal step makes it.",
        [_kept(variant, medians) for variant in ARRAYS],
        Plot("stiffness d of a contact [kg]", "median error of (M + JᵀDJ)⁻¹b", rows),
    )


def _kept(variant: str, medians: dict[tuple, float]) -> Check:
    own = {key[1:]: error / U[PRECISION] for key, error in medians.items() if key[0] == variant}
    worst = max(own, key=own.get, default=None)
    where = f"{worst[0]}, d = {worst[1]:.0e} kg" if worst else ""
    return within(f"{variant}: largest median error / u", own.get(worst), -math.inf, RISING, where)
