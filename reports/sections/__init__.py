"""The page's sections, in order: `section(data)` gives one, or None where its data is absent."""

from sections import (
    against_n,
    choosing,
    claims,
    cost,
    digits,
    error_against_time,
    fast_path,
    glance,
    limitations,
    method,
    mujoco,
    paper,
    peak,
    peers,
    simulation,
    wild,
)

SECTIONS = [
    glance.section,
    error_against_time.section,
    against_n.section,
    peers.section,
    peak.section,
    fast_path.section,
    mujoco.section,
    digits.section,
    claims.section,
    wild.section,
    choosing.section,
    paper.section,
    cost.section,
    simulation.section,
    method.section,
    limitations.section,
]
