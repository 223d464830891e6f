"""The page's sections, in order: `section(data)` gives one, or None where its data is absent."""

from importlib import import_module

ORDER = """
    engines answer compared stress robots over_robots
    error_against_time against_n peers peak fast_path square_roots scans questions
    motions contacts mujoco
    digits claims wild rare adversary looking choosing
    paper cost simulation identification jacobians
    method limitations
"""
SECTIONS = [import_module(f"sections.{name}").section for name in ORDER.split()]
