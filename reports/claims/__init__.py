"""Twelve claims about accuracy, each decided by the records of a run and nothing else.

A claim's rule stands in the docstring of its function, and `Claim.verdict` says how its checks
make the verdict.
"""

from claims.contacts import contacts
from claims.detection import residuals, silence
from claims.dynamics import refinement, stiffness
from claims.ratios import constraints, joseph, tiers
from claims.scans import scans
from claims.structure import exponential, length, scaled_condition

REPEATED = [  # by campaigns, with other seeds of `stress` and `integrate`
    length,
    scaled_condition,
    tiers,
    joseph,
    constraints,
    stiffness,
    residuals,
    refinement,
    silence,
    exponential,
    scans,
]
CLAIMS = [*REPEATED, contacts]
