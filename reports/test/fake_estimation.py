"""Made-up records of the programs paper, simulate and bench_estimation."""

import random

DIGITS = {"float64": 16, "mp": 55}
EPSILON = {"float64": 2e-16, "mp": 1e-55}
TOLERANCE = {"float64": 1e-12, "mp": 1e-48}
PAPERS = ["chain:6", "panda:7", "g1:35"]
FAILING = ("g1:35", "(5.5)")
UNEVALUABLE = "(4.2)"
EQUATIONS = [  # id, section, result, as printed, as corrected, note
    (
        "M(k)",
        "1",
        "",
        "M(k) = [I, m p~; −m p~, U]",
        "M(k) = [I, m p~; −m p~, m U]",
        "The mass is missing in the lower right block: the units show it, and the momentum of a "
        "moving body.",
    ),
    ("(1.5)", "1", "", "X = φW and T = HX", "", ""),
    ("(2.6)", "2", "", "P = (I − GH)R = R(I − GH)* = R − RH*(HRH*)⁻¹HR", "", ""),
    (
        "(3.12)",
        "3",
        "Result 3.4",
        "Ψ = (I − gH)Φ",
        "Ψ = (I − ΨgH)Φ",
        "The closed loop acts at every joint on the way, not at the last alone.",
    ),
    (
        "(4.2)",
        "4",
        "",
        "e⁻ = (I − L)T",
        "e⁻ = (I − L)(T − Hφb)",
        "The bias enters (4.4), so it must leave the measurements.",
    ),
    (
        "(5.5)",
        "5",
        "Result 5.4",
        "E(λλ*) = Λ + ΛΨ + Ψ*Λ",
        "E(λλ*) = Λ⁺ + Λ⁺(I − gH)Ψ + Ψ*(I − gH)*Λ⁺",
        "Ψ must lead from the + side to the + side of the joints. The Ψ of (3.14) does not.",
    ),
    ("(6.4)", "6", "", "a = M⁻¹T", "", ""),
    ("trees", "beyond", "", "P⁻(i) = M(i) + Σ φ P⁺ φᵀ over the children", "", ""),
    (
        "joint noise",
        "beyond",
        "",
        "M + diag(r) = (I + K)D(I + K*)",
        "",
        "D(k) = H P⁻ Hᵀ + r(k): rotor inertia at no extra cost.",
    ),
]
METHODS = {  # error of 64 samples, rate, time a sample in s
    "MonteCarlo": (0.3, -0.5, 2e-6),
    "Antithetic": (0.3 * 2**0.5, -0.5, 1.4e-6),
    "QuasiMonteCarlo": (0.2, -0.8, 3e-6),
}
QUANTITIES = ["M", "P", "D", "Lambda"]
SAMPLES = [64 * 2**i for i in range(9)]
REPLICAS = 8
TASKS = {  # time in ns at one link, order, largest size
    "acceleration/Ladder<default>": (55, 1, 100000),
    "covariances/recursion": (420, 1, 100000),
    "filter_smoother/recursion": (180, 1, 100000),
    "log_det_gradient/recursion": (510, 1, 100000),
    "inverse/ClosedForm<Conventional>": (40, 2, 1000),
    "operators/literal": (900, 3, 60),
}
SIZES = [5, 20, 40, 60, 100, 1000, 10000, 100000]
REFUSED = "operators/literal/chain:60/float64"


def paper(scene: str, precisions=("float64", "mp")) -> dict:
    dice = random.Random(f"paper {scene}")
    rows = []
    for id, section, result, statement, corrected, note in EQUATIONS:
        residuals = {}
        for precision in precisions:
            error = EPSILON[precision] * dice.uniform(1, 40)
            verdict = "misprint" if corrected else "holds"
            if (scene, id) == FAILING:
                error, verdict = 4e-3, "fails"
            residuals[precision] = {
                "printed": dice.uniform(0.2, 1.2) if corrected else error,
                "corrected": error,
                "tolerance": TOLERANCE[precision],
                "verdict": verdict,
            }
            if id == UNEVALUABLE:
                residuals[precision]["printed"] = None
        rows.append(
            {"id": id, "section": section, "result": result, "statement": statement}
            | {"corrected": corrected, "note": note, "residuals": residuals}
        )
    return {
        "scene": scene,
        "beyond_scene": "tree:14" if scene.startswith("chain") else scene,
        "seed": 1,
        "pass": scene != FAILING[0],
        "precisions": [
            {"precision": name, "digits": DIGITS[name], "condition": 1.2e4} for name in precisions
        ],
        "rows": rows,
    }


def simulation(scene: str) -> list[list]:
    """Rows of the CSV, in its order of columns."""
    dice = random.Random(f"simulation {scene}")
    n = int(scene.split(":")[1])
    rows = []
    for quantity in QUANTITIES:
        for method, (first, rate, seconds) in METHODS.items():
            for samples in SAMPLES:
                for replica in range(REPLICAS):
                    error = first * (samples / 64) ** rate * dice.lognormvariate(0, 0.25)
                    time = seconds * samples * dice.uniform(0.95, 1.1)
                    rows.append([scene, n, quantity, method, samples, replica, error, time, 2])
        sigma, recursion = dice.uniform(2e-16, 9e-16), dice.uniform(1e-16, 4e-16)
        rows.append([scene, n, quantity, "SigmaPoints", 6 * n, 0, sigma, 8.5e-5, 1])
        rows.append([scene, n, quantity, "Recursion", 0, 0, recursion, 1.3e-6, 1])
    return rows


def estimation() -> list[dict]:
    """Google Benchmark's rows."""
    dice = random.Random("estimation")
    rows = []
    for task, (first, order, largest) in TASKS.items():
        for size in (size for size in SIZES if size <= largest):
            name = f"{task}/chain:{size}/float64"
            common = {"name": name, "run_name": name, "run_type": "iteration", "repetitions": 3}
            if name == REFUSED:
                rows.append(common | {"error_occurred": True, "error_message": "singular"})
            else:
                time = first * size**order * dice.uniform(0.95, 1.05)
                rows.append(common | {"real_time": time, "time_unit": "ns"})
    return rows
