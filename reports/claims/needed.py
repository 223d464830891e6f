"""The variants that claims are about: of the records of `stress` these are read, in all families
and tasks."""

from claims.claim import ABA

JOSEPH = "Sequential<Joseph>"
CHOLESKY = "Batch<EigenLLT>"
MGS = "Sequential<ArrayMGS>"
GIVENS = "Sequential<ArrayGivens>"
UD = "Sequential<UD>"
HOUSEHOLDER = "Sequential<ArrayHouseholder>"
POTTER = "Sequential<Potter>"
ZEROED = "Sequential<Zeroed>"
FACTORED = "FactoredBias<ArrayMGS>"
WORLD = {  # exponents of the error in the offset of the base from the world's origin
    "Sequential<WorldOrigin<Joseph>>": 4,
    "Sequential<WorldOrigin<Conventional>>": 2,
    "Sequential<WorldOrigin<ArrayMGS>>": 1,
}
SCANS = {"Scan<Conventional>": ABA, "Scan<SquareRoot>": GIVENS}  # and what they are in sequence
JUDGED = (CHOLESKY, ABA, JOSEPH, MGS, GIVENS, UD)
INVERTING = (CHOLESKY, "ClosedForm<Conventional>", "ClosedForm<ArrayMGS>", *JUDGED[1:])

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
