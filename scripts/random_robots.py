"""Random robots of ordinary and odd kinds, as files, for scripts/robot_files --fuzz."""

import math
import random
from collections.abc import Callable


def rotation(rng: random.Random) -> list[list[float]]:
    w, x, y, z = quaternion(rng)
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]


def quaternion(rng: random.Random) -> list[float]:
    return unit([rng.gauss(0, 1) for _ in range(4)])


def unit(x: list[float]) -> list[float]:
    length = math.sqrt(sum(v * v for v in x))
    return [v / length for v in x]


def size(rng: random.Random, low: float = 1e-3, high: float = 1) -> float:
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def numbers(rng: random.Random, x: list[float]) -> str:
    digits = rng.choice((3, 4, 6, 9, 17))
    return " ".join(f"{v:.{digits}g}" for v in x)


def place(rng: random.Random) -> list[float]:
    return [rng.choice((0, rng.uniform(-.5, .5))) for _ in range(3)]


def axis(rng: random.Random) -> list[float]:
    if rng.random() < .6:
        out = [0.0, 0.0, 0.0]
        out[rng.randrange(3)] = rng.choice((1.0, -1.0))
        return out
    return unit([rng.gauss(0, 1) for _ in range(3)])


def moments(rng: random.Random, sort: str) -> list[float]:
    """Principal ones."""
    if sort == "point":
        return [0, 0, 0]
    second = [size(rng) for _ in range(3)]
    if sort == "flat":
        second[rng.randrange(3)] = 0
    if sort == "rod":
        second[0] = second[1] = 0
    out = [second[1] + second[2], second[0] + second[2], second[0] + second[1]]
    if sort == "unsolid":
        out[rng.randrange(3)] *= rng.uniform(2, 9)
    rng.shuffle(out)
    return out


def body(rng: random.Random, odd: str) -> tuple[float, list[float]]:
    """Mass and moments, of one of these sorts where it is odd: MuJoCo refuses a robot for each alone."""
    sort = rng.choice(odd.split()) if odd and rng.random() < .2 else "solid"
    mass = 0 if sort in ("rotor", "nothing") else size(rng, .01, 10)
    return mass, [0, 0, 0] if sort == "nothing" else moments(rng, "solid" if sort == "rotor" else sort)


def tensor(rng: random.Random, principal: list[float]) -> list[float]:
    """xx yy zz xy xz yz, on the body's axes or turned."""
    if rng.random() < .5:
        return [*principal, 0, 0, 0]
    R = rotation(rng)
    I = [[sum(R[i][k] * principal[k] * R[j][k] for k in range(3)) for j in range(3)] for i in range(3)]
    return [I[0][0], I[1][1], I[2][2], I[0][1], I[0][2], I[1][2]]


# --- URDF

def urdf_inertial(rng: random.Random, odd: str) -> str:
    mass, principal = body(rng, odd)
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    # A tensor that is singular keeps all digits: rounded, it would have a negative moment.
    digits = "17" if min(principal) == 0 else rng.choice(("4", "6", "9", "17"))
    inertia = " ".join(f'{n}="{v:.{digits}g}"' for n, v in zip(names, tensor(rng, principal)))
    return (f'<inertial><origin xyz="{numbers(rng, place(rng))}" rpy="{numbers(rng, place(rng))}"/>'
            f'<mass value="{mass:.9g}"/><inertia {inertia}/></inertial>')


def urdf_shape(rng: random.Random) -> str:
    a, b, c = (size(rng, .01, .3) for _ in range(3))
    shape = rng.choice((f'<box size="{a:.4g} {b:.4g} {c:.4g}"/>', f'<sphere radius="{a:.4g}"/>',
                        f'<cylinder radius="{a:.4g}" length="{b:.4g}"/>'))
    if rng.random() < .05:
        shape = '<box size="0 0 0"/>'
    return (f'<collision><origin xyz="{numbers(rng, place(rng))}" rpy="{numbers(rng, place(rng))}"/>'
            f"<geometry>{shape}</geometry></collision>")


def urdf(rng: random.Random, odd: str = "", bare: float = 0, shapes: float = 0,
         compiler: str = "", types: str = "continuous revolute prismatic fixed") -> dict[str, str]:
    """bare, shapes: shares of links without <inertial> and with collisions."""
    count = rng.randint(2, 9)
    names = [rng.choice(("world", "base", "base link", "Füße"))] + [f"l{i}" for i in range(1, count)]
    out = []
    for i, name in enumerate(names):
        inside = "" if rng.random() < (.6 if i == 0 else bare) else urdf_inertial(rng, odd)
        if rng.random() < shapes:
            inside += "".join(urdf_shape(rng) for _ in range(rng.randint(1, 2)))
        out.append(f'<link name="{name}">{inside}</link>')
    for i in range(1, count):
        kind = "continuous" if i == 1 else rng.choice(types.split())
        parent = names[rng.randrange(max(0, i - 3), i)]
        limit = f'<limit lower="{rng.uniform(-3, 0):.3g}" upper="{rng.uniform(0, 3):.3g}" effort="1" velocity="1"/>'
        out.append(f'<joint name="j{i}" type="{kind}"><parent link="{parent}"/><child link="{names[i]}"/>'
                   f'<origin xyz="{numbers(rng, place(rng))}" rpy="{numbers(rng, place(rng))}"/>'
                   f'<axis xyz="{" ".join(f"{x:.17g}" for x in axis(rng))}"/>'
                   f'{limit if kind in ("revolute", "prismatic") else ""}</joint>')
    rng.shuffle(out)
    options = f"<mujoco><compiler {compiler}/></mujoco>" if compiler else ""
    return {"robot.urdf": f'<robot name="r">{options}{"".join(out)}</robot>\n'}


def urdf_compiler(rng: random.Random) -> str:
    return options_of(rng, {
        "boundmass": (".5", "0.001"), "boundinertia": (".01", "1e-6"), "settotalmass": ("7", "-1"),
        "balanceinertia": ("true", "false"), "fusestatic": ("true", "false"),
        "inertiafromgeom": ("true", "false", "auto"), "discardvisual": ("true", "false")})


def options_of(rng: random.Random, options: dict[str, tuple[str, ...]]) -> str:
    chosen = rng.sample(sorted(options), rng.randint(1, 3))
    return " ".join(f'{name}="{rng.choice(options[name])}"' for name in chosen)


# --- MJCF

class Mjcf:
    def __init__(self, rng: random.Random, odd: str = "", bare: float = 0, geoms: float = 0,
                 named: float = .9, radian: bool = True, prefix: str = ""):
        self.rng, self.odd, self.bare, self.geoms = rng, odd, bare, geoms
        self.named, self.radian, self.prefix = named, radian, prefix
        self.count = 0

    def name(self, prefix: str) -> str:
        self.count += 1
        return f' name="{self.prefix}{prefix}{self.count}"' if self.rng.random() < self.named else ""

    def turn(self) -> str:
        rng, R = self.rng, rotation(self.rng)
        angles = [rng.uniform(-3, 3) * (1 if self.radian else 57.3) for _ in range(3)]
        return rng.choice((
            "", f' quat="{numbers(rng, quaternion(rng))}"', f' euler="{numbers(rng, angles)}"',
            f' axisangle="{numbers(rng, [*axis(rng), angles[0]])}"', f' zaxis="{numbers(rng, axis(rng))}"',
            f' xyaxes="{numbers(rng, [R[i][0] for i in range(3)] + [R[i][1] for i in range(3)])}"'))

    def joint(self, kind: str) -> str:
        rng = self.rng
        out = f'<joint{self.name("j")} type="{kind}"'
        if rng.random() < .3 and kind != "free":
            out += f' armature="{size(rng, 1e-3, .1):.4g}"'
        if kind in ("hinge", "slide"):
            out += f' axis="{numbers(rng, [2 * x for x in axis(rng)])}"'
            if rng.random() < .3:
                out += f' ref="{rng.uniform(-1, 1):.4g}"'
        if kind != "free" and rng.random() < .4:
            out += f' pos="{numbers(rng, place(rng))}"'
        return out + "/>"

    def all_joints(self, top: bool) -> str:
        rng = self.rng
        if rng.random() < .3:
            return ""
        if top and rng.random() < .2:
            return self.joint("free")
        if rng.random() < .15:
            return self.joint("ball")
        return "".join(self.joint(rng.choice(("hinge", "hinge", "slide")))
                       for _ in range(rng.choice((1, 1, 1, 2, 3))))

    def inertial(self) -> str:
        rng = self.rng
        mass, principal = body(rng, self.odd)
        if min(principal) > 0 and rng.random() < .4:
            inertia = f'fullinertia="{" ".join(f"{x:.9g}" for x in tensor(rng, principal))}"'
            turned = ""
        else:
            inertia, turned = f'diaginertia="{" ".join(f"{x:.9g}" for x in principal)}"', self.turn()
        return f'<inertial pos="{numbers(rng, place(rng))}"{turned} mass="{mass:.9g}" {inertia}/>'

    def geom(self) -> str:
        rng = self.rng
        a, b, c = (size(rng, .01, .3) for _ in range(3))
        shape = rng.choice((f'type="sphere" size="{a:.4g}"', f'type="box" size="{a:.4g} {b:.4g} {c:.4g}"',
                            f'type="capsule" size="{a:.4g} {b:.4g}"', f'type="cylinder" size="{a:.4g} {b:.4g}"',
                            f'type="ellipsoid" size="{a:.4g} {b:.4g} {c:.4g}"',
                            f'type="capsule" size="{a:.4g}" fromto="0 0 0 {b:.4g} {c:.4g} .1"'))
        where = "" if "fromto" in shape else f' pos="{numbers(rng, place(rng))}"{self.turn()}'
        weight = rng.choice(("", "", f' mass="{size(rng, .01, 3):.4g}"', f' density="{rng.choice((0, 300))}"',
                             ' mass="0"', ' shellinertia="true"'))
        return f'<geom {shape}{where}{weight} group="{rng.choice((0, 0, 1, 3))}"/>'

    def body(self, depth: int = 0, inside: str = "") -> str:
        rng = self.rng
        out = f'<body{self.name("b")} pos="{numbers(rng, place(rng))}"{self.turn()}>'
        joints = self.all_joints(depth == 0)
        out += joints
        has_geoms = rng.random() < self.geoms
        if rng.random() > (self.bare if joints and not has_geoms else .5):
            out += self.inertial()
        if has_geoms:
            out += "".join(self.geom() for _ in range(rng.randint(1, 3)))
        if depth < 4:
            out += "".join(self.body(depth + 1) for _ in range(rng.choice((0, 1, 1, 2))))
        return out + inside + "</body>"

    def world(self) -> str:
        return "".join(self.body() for _ in range(self.rng.randint(1, 3)))


def mjcf(rng: random.Random, compiler: str = "", **kind) -> dict[str, str]:
    radian = rng.random() < .5
    angle = f'angle="{"radian" if radian else "degree"}"'
    world = Mjcf(rng, radian=radian, **kind).world()
    return {"robot.xml": f"<mujoco><compiler {angle} {compiler}/><worldbody>{world}</worldbody></mujoco>\n"}


def mjcf_compiler(rng: random.Random) -> str:
    return options_of(rng, {
        "boundmass": (".5", "0.001"), "boundinertia": (".01", "1e-6"), "settotalmass": ("7", "-1"),
        "balanceinertia": ("true", "false"), "fusestatic": ("true", "false"), "eulerseq": ("XYZ", "zyx", "xzx"),
        "inertiafromgeom": ("true", "false", "auto"), "inertiagrouprange": ("0 1", "1 3"),
        "alignfree": ("true", "false"), "discardvisual": ("true", "false"), "autolimits": ("true",)})


def mjcf_includes(rng: random.Random) -> dict[str, str]:
    """Nested includes, defaults, frames, copies, and a model that is attached."""
    part = Mjcf(rng, geoms=.5, prefix="part_")
    parts = {"inner.xml": f"<mujocoinclude>{part.body(depth=1)}</mujocoinclude>\n",
             "outer.xml": f'<mujocoinclude><body pos="0 0 1">{part.joint("hinge")}{part.inertial()}'
                          '<include file="inner.xml"/></body></mujocoinclude>\n',
             "tool.xml": f'<mujoco model="tool"><worldbody>{Mjcf(rng).body(depth=1)}</worldbody></mujoco>\n',
             "defaults.xml": '<mujocoinclude><default><joint armature=".02"/><geom density="700"/>'
                             '<default class="light"><geom density="20"/></default></default></mujocoinclude>\n'}
    own = Mjcf(rng, geoms=.5)
    frame = f'<frame pos="{numbers(rng, place(rng))}"{own.turn()}>{own.body(depth=1)}</frame>'
    copies = ('<replicate count="3" offset="0 .3 0" euler="0 0 .3">'
              '<body><joint axis="0 1 0"/><geom type="box" size=".1 .2 .1"/></body></replicate>')
    attach = '<frame pos="0 0 2"><attach model="tool" prefix="tool_"/></frame>'
    robot = (f'<mujoco><compiler angle="radian"/><include file="defaults.xml"/><asset><model name="tool" file="tool.xml"/></asset>'
             f'<worldbody>{own.body()}<include file="outer.xml"/>{frame}{copies}{attach}</worldbody></mujoco>\n')
    return {"robot.xml": robot, **parts}


ODD = "flat unsolid rod point rotor nothing"
KINDS: dict[str, Callable[[random.Random], dict[str, str]]] = {
    "urdf-solid": urdf,
    "urdf-joints": lambda rng: urdf(rng, types="continuous prismatic fixed floating planar"),
    "urdf-tensors": lambda rng: urdf(rng, ODD),
    "urdf-flat": lambda rng: urdf(rng, "flat"),
    "urdf-massless": lambda rng: urdf(rng, "nothing", bare=.2),
    "urdf-collisions": lambda rng: urdf(rng, bare=.3, shapes=.8),
    "urdf-compiler": lambda rng: urdf(rng, ODD, shapes=.3, compiler=urdf_compiler(rng)),
    "mjcf-solid": mjcf,
    "mjcf-unnamed": lambda rng: mjcf(rng, named=.2),
    "mjcf-tensors": lambda rng: mjcf(rng, odd=ODD),
    "mjcf-flat": lambda rng: mjcf(rng, odd="flat"),
    "mjcf-massless": lambda rng: mjcf(rng, odd="nothing", bare=.1),
    "mjcf-geoms": lambda rng: mjcf(rng, geoms=.8),
    "mjcf-compiler": lambda rng: mjcf(rng, odd=ODD, geoms=.5, compiler=mjcf_compiler(rng)),
    "mjcf-includes": mjcf_includes,
}


def random_robot(kind: str, seed: int) -> dict[str, str]:
    """Texts by the names of their files; the first is the robot's."""
    return KINDS[kind](random.Random(f"{kind} {seed}"))
