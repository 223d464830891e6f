"""Made-up records of the programs recommend and limits."""

import random

EPSILON = {"float32": 6e-8, "float64": 1.1e-16}
VARIANTS = {  # time in ns at 7 degrees of freedom; error in units of epsilon
    "Ladder<default>": (170, 4),
    "AxisFrames<SquareRoot>": (330, 3),
    "Batch<EigenLLT>": (620, 30),
    "Batch<SparseLTDL>": (510, 40),
    "Sequential<Conventional>": (450, 4),
    "Sequential<ArrayMGS>": (1700, 3),
    "WideRefined<FactoredBias<ArrayGivens>>": (5000, 0.5),
}
TOLERANCES = (1e-3, 1e-5, 1e-6, 1e-9, 1e-12)
STATES = 200
LOADS = (
    (
        "payload",
        "Payload on the hand",
        "times the mass of the last link",
        [10**k for k in range(9)],
    ),
    ("armature", "Armature", "of the given", [1, 0.1, 0.01, 0]),
    ("wrist", "Light wrist", "of its mass", [1, 1e-2, 1e-4, 1e-6]),
)
REFUSED_FROM = 1e6  # payload that Cholesky in float32 refuses


def _contenders(scene: str, task: str) -> list[dict]:
    dice = random.Random(scene + task)
    n = int(scene.split(":")[1])
    rows = []
    for variant, (time, error) in VARIANTS.items():
        for precision, epsilon in EPSILON.items():
            median = error * epsilon * dice.uniform(0.5, 1.5)
            worst = median * dice.uniform(3, 6)
            rows.append(
                {
                    "variant": variant,
                    "precision": precision,
                    "nanoseconds": time * n / 7 * (0.8 if precision == "float32" else 1),
                    "median": median,
                    "worst": worst,
                    "predicted": worst * dice.uniform(1.5, 8),
                    "failures": 0,
                    "warnings": 0,
                }
            )
    return rows


def _choice(tolerance: float, contenders: list[dict]) -> dict:
    fit = [it for it in contenders if it["predicted"] <= tolerance]
    best = min(fit or contenders[-1:], key=lambda it: it["nanoseconds"])
    kept = ("variant", "precision", "predicted", "worst", "nanoseconds")
    reason = f"{best['variant']} in {best['precision']} is the cheapest within {tolerance:g}."
    return {
        "tolerance": tolerance,
        **{name: best[name] for name in kept},
        "enough": bool(fit),
        "reason": reason,
    }


def recommend(scene: str) -> dict:
    tasks = {}
    for task in ("acceleration", "acceleration_batch", "inverse"):
        contenders = _contenders(scene, task)
        if task.endswith("_batch"):  # the ladder alone has calls of rows
            contenders = [it for it in contenders if it["variant"].startswith("Ladder<")]
        choices = [_choice(tolerance, contenders) for tolerance in TOLERANCES]
        tasks[task] = {"contenders": contenders, "choices": choices}
    return {
        "robot": scene,
        "file": "",
        "load_options": "",
        "nv": int(scene.split(":")[1]),
        "states": STATES,
        "seed": 1,
        "sentence": f"Take Dynamics<double> for {scene}: right to 13 digits.",
        "tasks": tasks,
    }


def limits(scene: str) -> dict:
    stresses = []
    for name, title, unit, values in LOADS:
        curves = []
        for variant, (_, error) in VARIANTS.items():
            for precision, epsilon in EPSILON.items():
                worst = [
                    min(20 * error * epsilon * (v if v > 1 else 1 / max(v, 1e-7)), 3.0)
                    for v in values
                ]
                if variant == "Batch<EigenLLT>" and precision == "float32":
                    worst = [None if v >= REFUSED_FROM else e for v, e in zip(values, worst)]
                silent = [int(e is not None and e > 1e-2) for e in worst]
                curves.append(
                    {"variant": variant, "precision": precision, "worst": worst, "silent": silent}
                )
        tasks = {"acceleration": curves, "inverse": curves}
        stresses.append(
            {"name": name, "title": title, "unit": unit, "values": values, "tasks": tasks}
        )
    return {
        "robot": scene,
        "nv": int(scene.split(":")[1]),
        "seconds": 12.5,
        "evaluations": 12345,
        "sentence": "float32 is right to 5 digits with up to 3000 times the last link's mass.",
        "stresses": stresses,
    }
