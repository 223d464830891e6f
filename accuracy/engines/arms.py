"""Arms of ordinary proportions as numbers in [0, 1]: what search.py draws.

The first number is the count of hinges, 3 to 7. Then six of every link:
  mass       10^U(-2,1) kg: three decades
  length     10^U(-2,0) m, from its hinge to the next: two decades
  direction  half of the links lie across their hinge's axis, half along it
  twist      the next hinge's axis is parallel to this one or, in two thirds, a quarter turn away
  width      10 % to 50 % of the length: a solid of square cross-section
  com        30 % to 70 % of the length
"""

from typing import NamedTuple

HINGES = (3, 7)
GENES = 6  # of a link
LENGTH = 1 + GENES * HINGES[1]
MASS = (-2.0, 1.0)  # decades, kg
REACH = (-2.0, 0.0)  # decades, m


class Link(NamedTuple):
    mass: float
    length: float
    along: bool  # its hinge's axis, z; else across it, along x
    twist: int  # quarter turns about x
    width: float
    com: float  # from the hinge


def _between(x: float, limits: tuple[float, float]) -> float:
    return limits[0] + x * (limits[1] - limits[0])


def _choice(x: float, count: int) -> int:
    return min(int(x * count), count - 1)


def decode(x) -> list[Link]:
    """`x`: LENGTH numbers; those of links that the arm has not are passed over."""
    x = [float(number) for number in x]
    low, high = HINGES
    count = low + _choice(x[0], high - low + 1)
    links = []
    for k in range(count):
        mass, length, along, twist, width, com = x[1 + GENES * k : 1 + GENES * (k + 1)]
        reach = 10 ** _between(length, REACH)
        links.append(
            Link(
                10 ** _between(mass, MASS),
                reach,
                along >= 0.5,
                _choice(twist, 3) - 1,
                reach * _between(width, (0.1, 0.5)),
                reach * _between(com, (0.3, 0.7)),
            )
        )
    return links


def _at(link: Link, distance: float) -> str:
    return f"0 0 {distance!r}" if link.along else f"{distance!r} 0 0"


def _moments(link: Link) -> str:
    """About the com: m w^2 / 6 about the link, m (l^2 + w^2) / 12 across it."""
    own = link.mass * link.width**2 / 6
    across = link.mass * (link.length**2 + link.width**2) / 12
    return " ".join(map(repr, (across, across, own) if link.along else (own, across, across)))


def mjcf(links: list[Link]) -> str:
    """The arm on the ground; its parameters have all digits."""
    lines, ends, placed = [], [], 'pos="0 0 0"'
    for k, link in enumerate(links):
        pad = "  " * (k + 2)
        lines += [
            f'{pad}<body name="link{k + 1}" {placed}>',
            f'{pad}  <joint name="j{k + 1}" type="hinge" axis="0 0 1"/>',
            f'{pad}  <inertial pos="{_at(link, link.com)}" mass="{link.mass!r}" '
            f'diaginertia="{_moments(link)}"/>',
        ]
        ends.append(f"{pad}</body>")
        turn = "" if not link.twist else f' quat="1 {link.twist} 0 0"'
        placed = f'pos="{_at(link, link.length)}"{turn}'
    body = "\n".join([*lines, *reversed(ends)])
    return f'<mujoco model="arm">\n  <worldbody>\n{body}\n  </worldbody>\n</mujoco>\n'
