"""The reference holds every public call: docs/calls.md is compared with the headers, as Doxygen reads them for the site that
scripts/docs has made, and with the Python package's sources and stubs. Tables of results are compared with their data."""

import ast
import json
import re
import subprocess
import sys
import tarfile
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).parents[3]
sys.path.append(str(ROOT / "scripts/site"))
import measured  # noqa: E402
from measured import tables  # noqa: E402

SITE = ROOT / "build/site"
PACKAGE = ROOT / "python/src/kalmarm"

# What holds numbers, and the members that say what an object was made of.
HOLDERS = {"VectorView", "MatrixView", "RowsView", "Outcome", "Question", "Constraint", "RobotModel", "ImplicitStep::Numbers"}
TOLD = {"nq", "nv", "asked", "tolerance", "frames", "h", "mass"}
OF_TYPES = {"to_string", "all_rules", "is_of_frames", "takes_spring", "q_entries"}


def names(cell: str) -> list[str]:
    return re.findall(r"`([\w:.]+)`", cell)


def listed(language: str, known: set[str], mark: str) -> set[str]:
    """Names in the column of a language; where the column's head names a class, members of it first."""
    found = set()
    for head, _, *rows in tables("docs/calls.md"):
        columns = [i for i, cell in enumerate(head) if cell.startswith(language)]
        for column in columns:
            owner = names(head[column])
            for row in rows:
                for name in names(row[column]):
                    member = mark.join([*owner, name])
                    found.add(member if member in known else name)
    return found


def functions_of_headers() -> dict[str, list[str]]:
    """What is said of every public function but constructors and operators; the comment of each overload."""
    found: dict[str, list[str]] = {}
    for file in (ROOT / "build/doxygen/kalmarm/xml").glob("*.xml"):
        for compound in ElementTree.parse(file).getroot().iter("compounddef"):
            owner = compound.findtext("compoundname").removeprefix("kalmarm").removeprefix("::")
            if compound.get("kind") not in ("class", "struct", "namespace"):
                continue
            for member in compound.iter("memberdef"):
                name = member.findtext("name")
                made = owner.split("::")[-1]
                if (
                    (member.get("kind"), member.get("prot")) == ("function", "public")
                    and name != made
                    and re.fullmatch(r"\w+", name)
                ):
                    about = (member.find("briefdescription"), member.find("detaileddescription"))
                    text = " ".join(" ".join(part.itertext()) for part in about)
                    found.setdefault(f"{owner}::{name}" if owner else name, []).append(text)
    return found


def members_of_package() -> set[str]:
    """Public functions, and methods of public classes, of the package and of what they inherit from compiled ones."""
    trees = {file.stem: ast.parse(file.read_text(encoding="utf-8")) for file in PACKAGE.glob("*.py*") if file.suffix in (".py", ".pyi")}
    exported = next(
        ast.literal_eval(node.value)
        for node in trees["__init__"].body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
    )
    found = set()
    for tree in trees.values():
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and node.name in exported:
                found.add(node.name)
            elif isinstance(node, ast.ClassDef) and node.name in exported:
                for member in node.body:
                    decorated = {ast.unparse(one) for one in getattr(member, "decorator_list", [])}
                    if (
                        isinstance(member, ast.FunctionDef)
                        and "property" not in decorated
                        and not member.name.startswith("_")
                    ):
                        found.add(f"{node.name}.{member.name}")
    return found


def test_every_page_of_docs_is_in_the_navigation():
    shown = (ROOT / "scripts/site/mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:\n")[2]
    pages = [page.relative_to(ROOT) for page in (ROOT / "docs").rglob("*.md")]
    pages += [page.relative_to(ROOT).with_suffix(".md") for page in (ROOT / "docs/notebooks").glob("*.py")]
    assert len(pages) > 20
    assert [str(page) for page in pages if f": {page}\n" not in shown] == []


@pytest.mark.parametrize("page", sorted((ROOT / "docs/upstream").glob("*.md")), ids=lambda page: page.stem)
def test_text_for_an_engines_authors_has_a_program_and_what_it_printed(page):
    """The program needs the engine, what the engine is made of, and NumPy."""
    found = re.search(r"```python\n(.*?)```\n\nPrinted:\n\n```\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    program, printed = found.groups()
    imported = {one.names[0].name for one in ast.walk(ast.parse(program)) if isinstance(one, ast.Import)}
    assert imported <= {"numpy", "jax", "jax.numpy", "mujoco", "mujoco_warp", "newton"}
    assert "numpy" in imported and len(program.splitlines()) <= 40
    assert re.search(r"\de-\d\d", printed)


HEADERS = functions_of_headers()
MEMBERS = members_of_package()


def test_calls_were_found():
    assert {"Dynamics::forward_dynamics", "ImplicitStep::step", "integrate", "load_robot"} <= set(HEADERS)
    assert {"Robot.forward_dynamics", "Robot.replace", "Factors.solve", "load"} <= MEMBERS


def test_every_call_of_the_headers_is_in_the_table_of_calls():
    calls = {
        name
        for name in HEADERS
        if name.rpartition("::")[0] not in HOLDERS
        and name not in OF_TYPES
        and not ("::" in name and name.rpartition("::")[2] in TOLD)
    }
    assert calls - listed("C++", set(HEADERS), "::") == set()


def test_every_call_of_the_package_is_in_the_table_of_calls():
    assert MEMBERS - listed("Python", MEMBERS, ".") == set()


def test_every_call_of_the_table_is_there():
    classes = {name.rpartition("::")[0] for name in HEADERS}
    assert listed("C++", set(HEADERS), "::") - set(HEADERS) - classes == set()
    told = {"__call__", "robot", "constraints", "Builder", "Robot.compiled", "Robot.nq", "Robot.nv", "Robot.frames", "Kinematics.mass"}
    assert listed("Python", MEMBERS, ".") - MEMBERS - told == set()


def test_costs_of_the_table_are_those_of_the_headers():
    compared = 0
    for head, _, *rows in tables("docs/calls.md"):
        column = next((i for i, cell in enumerate(head) if cell.startswith("flops")), None)
        if column is None:
            continue
        owner = names(head[1])
        for row in rows:
            cost = row[column].replace("²", "^2").replace("³", "^3")
            for name in names(row[1]) if cost else []:
                member = "::".join([*owner, name])
                said = " ".join(HEADERS.get(member, []) + HEADERS.get(name, []))
                assert re.search(rf"(?<![\d^]){re.escape(cost)}(?!\w)", said), f"{name}: {cost}"
                compared += 1
    assert compared > 15


def test_every_call_of_the_package_has_its_place_in_the_reference():
    pages = "".join(page.read_text(encoding="utf-8") for page in (SITE / "python").glob("*.html"))
    places = set(re.findall(r'id="kalmarm\.([\w.]+)"', pages))
    assert MEMBERS | {"Robot", "Kinematics", "ImplicitStep", "outcome_dtype"} <= places


def test_table_of_variants_is_what_the_example_report_measured():
    (head, _, *rows), *_ = tables("docs/variants.md")
    assert len(rows) == 13
    for variant, *numbers in rows:
        name = re.sub(r"\[?`(.+)`\].*", r"\1", variant)
        expected = [
            f"{measured.times('times', scene, 'float64')[task, name]:.3g}"
            for scene in ("panda", "g1")
            for task in ("acceleration", "inverse")
        ]
        for scene, precision in (("g1", "float64"), ("straight-127", "float64"), ("straight-127", "float32")):
            error = measured.errors(scene, precision).get(("acceleration", name), "–")
            expected.append("refused" if error is None else error if error == "–" else f"{error:.0e}")
        assert numbers == [re.sub(r"e([+-])0", r"e\1", number) for number in expected]


def test_table_of_the_readme_is_what_the_example_report_measured():
    (head, _, *rows), *_ = tables("README.md")
    cases = [("times", "float64", "Ladder<default>", ""), ("batch", "float32", "Ladder<default>", "_batch"), ("times", "float64", "Ladder<last_bits>", "")]
    assert len(rows) == len(cases)
    for row, (kind, precision, variant, suffix) in zip(rows, cases):
        times, errors = measured.times(kind, "g1", precision), measured.errors("g1", precision)
        for cell, task in zip(row[3:5], ("acceleration", "inverse")):
            assert float(cell) == float(f"{times[task + suffix, variant]:.3g}") or cell == f"{times[task + suffix, variant]:.2g}"
        assert float(row[5]) == float(f"{errors['acceleration' + suffix, variant]:.0e}")


def test_history_is_of_times_over_those_of_mujoco():
    command = [ROOT / "scripts/site/history", measured.ARCHIVE]
    written = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    series = {one["name"]: one["value"] for one in written}
    times = measured.times("times", "g1", "float64")
    ratio = times["inverse", "Ladder<default>"] / times["inverse", "MuJoCo"]
    assert series["inverse/Ladder<default>/g1"] == pytest.approx(ratio, abs=1e-4)
    assert len(series) == len(written) > 20


def test_history_has_the_worst_error_of_every_engine(tmp_path):
    rows = ["scene,variant,precision,task,value"]
    for value in ("1e-7", "3e-4", "nan"):
        rows.append(f"iiwa14:7,MJX,float32,acceleration,{value}")
    rows += ["iiwa14:7,MJX,float32,mass,1", "g1:35,Newton,float32,acceleration,nan"]
    (tmp_path / "errors-engines-mjx.csv").write_text("\n".join(rows))
    (tmp_path / "times-engines-mjx.csv").write_text("scene,nanoseconds\n")
    with tarfile.open(tmp_path / "data.tar.xz", "w:xz") as archive:
        for file in tmp_path.glob("*.csv"):
            archive.add(file, f"data/{file.name}")
    command = [ROOT / "scripts/site/history", tmp_path / "data.tar.xz"]
    written = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    assert written == [{"name": "engines/MJX/float32/iiwa14-7", "unit": "worst error", "value": 3e-4}]


def test_reports_stay_where_they_were_published(tmp_path):
    def git(*words: str) -> str:
        ran = subprocess.run(["git", *words], cwd=tmp_path / "work", capture_output=True, check=True, text=True)
        return ran.stdout

    def publish(text: str, address: str) -> int:
        (tmp_path / "report").mkdir(exist_ok=True)
        (tmp_path / "report/index.html").write_text(text)
        command = [ROOT / "scripts/site/publish", tmp_path / "report", address]
        return subprocess.run(command, cwd=tmp_path / "work", capture_output=True).returncode

    (tmp_path / "work").mkdir()
    git("init", "-q", "--bare", tmp_path / "remote")
    git("init", "-q")
    git("remote", "add", "origin", tmp_path / "remote")
    git("config", "user.name", "test")
    git("config", "user.email", "test@kalmarm.invalid")
    git("commit", "-q", "--allow-empty", "-m", "first")
    assert publish("one", "v0.1.0") == 0
    assert publish("two", "weekly/2026-11-30") == 0
    assert publish("other", "v0.1.0") == 2
    assert publish("other", "../v0.1.0") == 2
    git("fetch", "-q", "origin", "gh-pages")
    assert git("show", "FETCH_HEAD:reports/v0.1.0/index.html") == "one"
    assert git("show", "FETCH_HEAD:reports/weekly/2026-11-30/index.html") == "two"
    listed = git("show", "FETCH_HEAD:reports/index.html")
    assert "v0.1.0/index.html" in listed and "weekly/2026-11-30/index.html" in listed
