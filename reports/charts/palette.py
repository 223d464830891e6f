"""A colour for each variant, a shape for each precision and each way to simulate.

The hue says the family (`Sequential` of `Sequential<UD>`), the shade the variant within it; shades
differ in lightness, for readers with any colour vision. A colour is a pair: light page, dark page.
"""

from zlib import crc32

MARKS = ("circle", "triangle-up", "diamond", "square", "triangle-down")
_RESIDUALS = ("inverse_dynamics", "forward_dynamics", "innovations", "mass_matrix", "likelihood")
RESIDUALS = dict(zip(_RESIDUALS, MARKS))  # of a fit
_METHODS = ("MonteCarlo", "Antithetic", "QuasiMonteCarlo", "SigmaPoints", "Recursion")
METHODS = dict(zip(_METHODS, MARKS))  # ways to simulate the random model
SHAPES = dict(zip(("float64", "float32", "mp"), MARKS))
_SHADES = {
    "Batch": (
        "#22308a/#6880d4 #0674b6/#78c1fe #0f9ab4/#a1ecfe #5740a1/#9f90eb #088cb9/#89d8fe "
        "#04488d/#5995e1"
    ),
    "Sequential": (
        "#a6560a/#faa264 #701800/#c8664e #c38406/#fed7a1 #972430/#e57c7e #c65d26/#feba9b "
        "#6a3d01/#c9802d #e0353b/#ff8f8a #8a7a00/#e9d94a #b8006b/#ff7cc0 #5a4a42/#bfa79a"
    ),
    "WorldAxes": "#107f7a/#27d4cc #0a5a86/#5cb8ee #3f8f4f/#86e29a",
    "WorldOrigin": "#4b1f7e/#9372c8 #a33bd0/#dd9bfb #6f9018/#caed8b",
    "FactoredBias": "#00786a/#3fe0c8 #2f5d00/#9fd05f",
    "StackedQR": "#31708f/#9fd3ea",
    "Scan": "#0b6e4f/#5fd3a8 #7d5ba6/#c9a7f0",
    "DivideAndConquer": "#9a3412/#f2a07b #64748b/#b3bfce",
    "MixedPrecision": "#94234a/#e27b95 #c05a8a/#ffb3d3 #5b1640/#b56a93",
    "ClosedForm": "#248430/#82d085 #034933/#029e72 #29a164/#93f8b8 #0a6453/#14b99b",
    "Refined": "#8f4fa9/#d9a0f3 #6b0755/#b9649f #d76797/#ffcfe0 #7c2f82/#c882cc",
    "Ladder": (
        "#73740c/#bfc156 #463d01/#98870c #ac9008/#f9dd73 #33500f/#d3f0a0 #8d8d2f/#f2f3b0 "
        "#2f6f8d/#a6dcf2 #5c6b00/#d4e157 #6d5200/#e0b84c #3e4a1f/#a5b47a #9e7c3a/#ffe3a3 "
        "#4f7a5b/#a8d8b4"
    ),
    "Generated": (  # code for one robot
        "#3c4043/#d5d9de #7a5a00/#e6c35c #00566b/#5cc4dd #7b2d5b/#dd8fbd #3f6212/#a9d36b "
        "#8a3b12/#eda47f #4338a0/#a39cf0 #0f6b4a/#66d0a6 #6b6f75/#a5abb3"
    ),
    "AxisFrames": "#1b5e20/#7bc67f #4b8a08/#b4e36a #00695c/#5fd6c3",
    "Pinocchio": (
        "#c2185b/#ff80ab #8e1144/#d95c8f #e0559a/#ffb0d4 #6b2f4a/#c48aa6 #4a0d2b/#ffe0ee "
        "#d0417f/#b0567f"
    ),
    "DART": "#1565c0/#6fb1ff",
    "Simbody": "#9c27b0/#e08bf0",
    "Bullet": "#d32f2f/#ff8a80",
    "KDL": "#00838f/#4fd8e6",
    "MuJoCo": "#5f6368/#b9bec5",
    "Kalmarm conventional": "#8d8d2f/#f2f3b0",
    "Kalmarm certified": "#33500f/#d3f0a0",
    "MJX": "#b35209/#ffae66",
    "MuJoCo Warp": "#701800/#c8664e",
    "Drake": "#248430/#82d085",
    "PyBullet": "#d32f2f/#ff8a80",
    "dynibo": "#4b1f7e/#9372c8",
    "adam": "#0f9ab4/#a1ecfe",
    "Brax": "#8f4fa9/#d9a0f3",
    "JaxSim": "#107f7a/#27d4cc",
    "frax": "#ac9008/#f9dd73",
    "Newton": "#1b5e20/#7bc67f",
    "GRiD": "#c2185b/#ff80ab #8e1144/#d95c8f",
    "Kalmarm, C++": "#73740c/#bfc156",
    "Rounded parameters": "#1d1f22/#f1f3f5",
    "CRBA": "#1d1f22/#f1f3f5",
    "MonteCarlo": "#22508a/#7fb2f0",
    "Antithetic": "#9a3fb5/#e2a8f5",
    "QuasiMonteCarlo": "#0b8a6f/#35d9b5",
    "SigmaPoints": "#a8123c/#f0708f",
    "Recursion": "#b35209/#ffae66",
    "Factored": "#248430/#82d085",
    "AutoDiff": "#22508a/#7fb2f0",
    "NumericDiff": "#b35209/#ffae66",
    "NumericDiffCentral": "#8a1f4b/#f08cb4",
    "springs_at_end": "#248430/#82d085 #034933/#029e72",
    "springs_at_start": "#107f7a/#27d4cc #0a5a86/#5cb8ee",
    "semi_implicit_euler": "#b35209/#ffae66 #701800/#c8664e",
    "rk4": "#e0353b/#ff8f8a #972430/#e57c7e",
    "dopri5": "#8f4fa9/#d9a0f3 #6b0755/#b9649f",
    "cvode_bdf": "#22508a/#7fb2f0 #04488d/#5995e1",
    "mj_euler": "#1d1f22/#f1f3f5",
    "mj_implicitfast": "#6b2f4a/#c48aa6",
    "mj_discrete": "#5f6368/#b9bec5",
    "mj_rk4": "#ac9008/#f9dd73",
    "inverse_dynamics": "#22508a/#7fb2f0",
    "forward_dynamics": "#b35209/#ffae66",
    "innovations": "#248430/#82d085",
    "mass_matrix": "#5f6368/#b9bec5",
    "likelihood": "#9a3fb5/#e2a8f5",
}
_UNKNOWN = "#107f7a/#27d4cc #4b1f7e/#9372c8 #6f9018/#caed8b #94234a/#e27b95"


def _ramp(shades: str) -> list[tuple[str, str]]:
    return [tuple(shade.split("/")) for shade in shades.split()]


FAMILIES = {name: _ramp(shades) for name, shades in _SHADES.items()}
UNKNOWN_FAMILIES = [_ramp(_UNKNOWN), _ramp(_UNKNOWN)[::-1]]
SHADES = {  # of variants that look alike in all reports; "-" is left to others
    variant: shade
    for variants in (
        "Batch<EigenLLT> Batch<EigenLDLT> Batch<OpenBLAS> Batch<SparseLTDL>",
        "Sequential<Conventional> Sequential<ArrayMGS> Sequential<UD> Sequential<Zeroed> - "
        "- Sequential<Joseph> Sequential<ArrayGivens> Sequential<Potter> "
        "Sequential<ArrayHouseholder>",
        "Sequential<WorldOrigin<Conventional>> Sequential<WorldOrigin<Joseph>> "
        "Sequential<WorldOrigin<ArrayMGS>>",
        "FactoredBias<ArrayMGS> FactoredBias<ArrayGivens>",
        "ClosedForm<Conventional>",
        "Scan<Conventional> Scan<SquareRoot>",
        "DivideAndConquer DivideAndConquer<Projected>",
        "Ladder<default> Ladder<default>@clang Ladder<default>@gcc "
        "Ladder<last_bits> Ladder<last_bits>@clang Ladder<last_bits>@gcc",
        "AxisFrames<SquareRoot> AxisFrames<SquareRoot>@clang AxisFrames<SquareRoot>@gcc",
        "Pinocchio<LOCAL>@clang Pinocchio<LOCAL>@gcc Pinocchio<WORLD>@clang Pinocchio<WORLD>@gcc "
        "Pinocchio<generated>@clang Pinocchio<generated>@gcc",
        *("DART", "Simbody", "Bullet", "KDL", "MuJoCo", "CRBA", *METHODS),
    )
    for shade, variant in enumerate(variants.split())
    if variant != "-"
}


def family(variant: str) -> str:
    """The word before the first bracket or @; of a filter in another frame, that frame."""
    first, *rest = variant.split("@")[0].split("<")
    return rest[0] if rest and rest[0].startswith("World") else first


def colours(variants) -> dict[str, tuple[str, str]]:
    """Variants of SHADES look alike in all reports; others take a free shade of their family."""
    result = {}
    for variant in sorted(set(variants), key=lambda variant: (variant not in SHADES, variant)):
        name = family(variant)
        ramp = FAMILIES.get(name) or UNKNOWN_FAMILIES[crc32(name.encode()) % len(UNKNOWN_FAMILIES)]
        first = SHADES.get(variant, crc32(variant.encode()))
        shades = [ramp[(first + step) % len(ramp)] for step in range(len(ramp))]
        result[variant] = next(
            (shade for shade in shades if shade not in result.values()), shades[0]
        )
    return result


def shape(variant: str) -> str:
    """Of a variant where precisions have no shapes."""
    return (METHODS | RESIDUALS).get(variant, "circle")


def shapes(precisions) -> dict[str, str]:
    return {
        precision: SHAPES.get(precision, "square")
        for precision in sorted(set(precisions), reverse=True)
    }
