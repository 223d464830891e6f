"""The page's sections, in order: `section(data)` gives one, or None where its data is absent."""

from sections import against_n, error_against_time, glance, limitations, method, mujoco

SECTIONS = [
    glance.section,
    error_against_time.section,
    against_n.section,
    mujoco.section,
    method.section,
    limitations.section,
]
