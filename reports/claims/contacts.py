"""Whether square roots keep float32's digits beside contacts of any stiffness: C12."""

import math
from statistics import median

from claims.claim import RISING, Check, Claim, Plot, row
from claims.needed import CHOLESKY, GIVENS, MGS
from read.data import Data
from read.stress import U
from summary.groups import by_key

PRECISION = "float32"
ARRAYS = (MGS, GIVENS, "Sequential<ArrayHouseholder>")


def contacts(data: Data) -> Claim:
    """C12. Float32, robots that stand. For every robot and stiffness the median error of H^-1 b by
    an array, a refusal being infinitely wrong, is at most 100 u: by Gram-Schmidt, by rotations and
    by reflections."""
    own = [
        it
        for it in data.contact_errors
        if it.precision == PRECISION and it.variant in (*ARRAYS, CHOLESKY)
    ]
    rows, medians = [], {variant: [] for variant in ARRAYS + (CHOLESKY,)}
    groups = by_key(own, lambda it: (it.variant, it.scene, it.stiffness))
    for (variant, scene, stiffness), answers in groups.items():
        errors = [math.inf if it.error is None else it.error for it in answers]
        error, share = median(errors), sum(map(math.isinf, errors)) / len(errors)
        place = scene, "contacts", variant, PRECISION, stiffness
        rows.append(row(*place, error, share, len(errors)))
        medians[variant].append((error / U[PRECISION], f"{scene}, d = {stiffness:.0e} kg"))
    return Claim(
        "C12",
        "Square roots and contacts",
        "Square roots keep float32’s digits under any contact stiffness: the median error of "
        "(M + JᵀDJ)⁻¹b by an array stays below 100 u, whichever orthogonal step makes it.",
        [
            Check.largest(f"{variant}: largest median error / u", medians[variant], RISING)
            for variant in ARRAYS
        ],
        Plot("stiffness d of a contact [kg]", "median error of (M + JᵀDJ)⁻¹b", rows),
    )
