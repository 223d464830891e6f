"""What the claims read of the records of `stress`: these variants, in all families and tasks."""

from claims.claim import ABA, CHOLESKY, GIVENS, JOSEPH, MGS, UD
from claims.detection import INVERTING
from claims.dynamics import FACTORED
from claims.ratios import HOUSEHOLDER, POTTER, WORLD, ZEROED
from claims.scans import SCANS

# Names that end in * are all that begin so. What is refined is there too, for its error before.
VARIANTS = (
    *dict.fromkeys((ABA, CHOLESKY, GIVENS, JOSEPH, MGS, UD, *INVERTING)),
    HOUSEHOLDER,
    POTTER,
    ZEROED,
    *WORLD,
    FACTORED,
    *SCANS,
    "FactoredBias<ArrayGivens>",
    "Refined<*",
    "WideRefined<*",
)
