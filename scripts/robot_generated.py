"""Code of `generate` for a robot, compiled and compared with the truth: what robot_files --generated runs."""

import pathlib
import subprocess
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
GENERATE = ROOT / "build/bin/generate"
# Derivatives are left out: compilers take minutes for those of a robot of many joints.
TASKS = ("forward_dynamics,inverse_dynamics,mass,inverse_mass,diagonal,solve,judged_forward_dynamics,"
         "judged_inverse_mass,judged_diagonal,judged_solve,judged_implicit_step")
REFUSED = ("code is generated for at most", "singular mechanism", "has no joints", "nothing can move")
SECONDS = 300


def shipped():
    """Names of the robots in robots/models."""
    return sorted(path.name for path in (ROOT / "robots/models").iterdir()
                  if (path / f"{path.name}.xml").exists() or (path / f"{path.name}.urdf").exists())


def compare(robot, precision):
    """"right", a reason why there is no code, or what is wrong, which begins with "wrong"."""
    with tempfile.TemporaryDirectory() as folder:
        def run(*command):
            return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=SECONDS)
        try:
            made = run(GENERATE, robot, "--task", TASKS, "--precision", precision, "--random", "1",
                       "--out", "robot")
            last = (made.stderr.strip().splitlines() or [""])[-1]
            if made.returncode:
                return next((reason for reason in REFUSED if reason in last), f"wrong: {last}")
            compiled = run("cc", "-std=c99", "-O0", "-o", "robot", "robot_test.c", "robot.c", "-lm")
            if compiled.returncode:
                return f"wrong: {compiled.stderr.strip().splitlines()[0]}"
            done = run("./robot")
        except subprocess.TimeoutExpired as late:
            return f"wrong: {pathlib.Path(late.cmd[0]).name} takes more than {SECONDS} s"
    return "right" if done.returncode == 0 else f"wrong: {done.stdout.strip().splitlines()[-1]}"
