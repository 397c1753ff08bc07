"""Dependencies are declared where they are imported, their licences are on a page, their versions pinned."""

import ast
import importlib.metadata
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from docs import make_licences

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
STACKS = ("web", "cluster")
OF_EXTRAS = {
    "grader/scan/decode/heic.py": "heic",
    "grader/web": "web",
    "grader/folder/cluster.py": "cluster",
    "grader/cycle": "plots",
}


def plain(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def names(requirements):
    return {plain(Requirement(one).name) for one in requirements}


def imported(path):
    """The packages that a module imports, standard library and own ones left out."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.partition(".")[0])
    return found - sys.stdlib_module_names - {"grader", "reference"}


def test_what_is_imported_is_declared():
    provided = importlib.metadata.packages_distributions()
    missing = set()
    for package in ("grader", "reference"):
        for path in (ROOT / package).rglob("*.py"):
            where = path.relative_to(ROOT).as_posix()
            extras = [EXTRAS[extra] for start, extra in OF_EXTRAS.items() if where.startswith(start)]
            declared = names([*PROJECT["dependencies"], *(one for extra in extras for one in extra)])
            for name in imported(path):
                if declared.isdisjoint(map(plain, provided.get(name, [name]))):
                    missing.add((where, name))
    # The command line tells which extra to install where one of these is not there.
    assert {name for where, name in missing if not where.startswith("grader/cli/")} == set()


def test_what_is_declared_is_imported():
    # Whoever installs planmark downloads nothing that it never uses.
    modules = [path for package in ("grader", "reference") for path in (ROOT / package).rglob("*.py")]
    used, provided = set().union(*map(imported, modules)), importlib.metadata.packages_distributions()
    needed = {plain(name) for module in used for name in provided.get(module, [module])}
    assert names(PROJECT["dependencies"]) - needed == set()


def test_every_dependency_stands_on_the_page_with_its_licence():
    rows = dict(re.findall(r"(?m)^\| (\S+) \| (.+) \|$", make_licences.PAGE.read_text("utf-8")))
    licensed = {plain(name) for name, licence in rows.items() if len(licence) > 2}
    wanted = names(
        [*PROJECT["dependencies"], *(one for extra in ("web", "cluster", "plots") for one in EXTRAS[extra])]
    )
    assert wanted - licensed == set()
    assert "Mozilla" in rows["certifi"]
    assert "LGPL" in rows["jwcrypto"]


def test_the_metadata_name_every_licence():
    assert [one.name for one in make_licences.packages() if not one.licence] == []


def pins(stack):
    """The versions of a stack, and how many hashes each has."""
    text = (ROOT / "constraints" / f"{stack}.txt").read_text("utf-8")
    found = re.findall(r"(?m)^(\S+)==(\S+)((?: \\\n    --hash=sha256:[0-9a-f]{64})+)$", text)
    assert len(re.findall("==", text)) == len(found)
    return {plain(name): (version, hashes.count("sha256")) for name, version, hashes in found}


@pytest.mark.parametrize("stack", STACKS)
def test_a_stack_is_held_in_versions_that_are_allowed_with_hashes(stack):
    held = pins(stack)
    for line in (*PROJECT["dependencies"], *EXTRAS[stack], *EXTRAS["plots"]):
        one = Requirement(line)
        version, hashes = held[plain(one.name)]
        assert one.specifier.contains(version), line
        assert hashes


def test_no_file_of_versions_names_a_registry():
    files = [
        *(ROOT / "constraints").iterdir(),
        ROOT / "tests" / "constraints.txt",
        ROOT / "docs" / "licences.md",
    ]
    assert not [
        path.name for path in files if re.search(r"https?://|file:|--(extra-)?index", path.read_text("utf-8"))
    ]


@pytest.mark.slow
def test_a_bill_of_materials_names_all_that_is_held(tmp_path):
    pytest.importorskip("cyclonedx_py")
    source, out = ROOT / "constraints" / "cluster.txt", tmp_path / "sbom.json"
    call = [
        "requirements",
        source,
        "--pyproject",
        ROOT / "pyproject.toml",
        "--output-reproducible",
        "-o",
        out,
    ]
    subprocess.run(  # noqa: S603 - a tool of ours
        [sys.executable, "-m", "cyclonedx_py", *map(str, call)], check=True, capture_output=True, cwd=tmp_path
    )
    bill = json.loads(out.read_bytes())
    assert bill["bomFormat"] == "CycloneDX"
    assert {plain(one["name"]): one["version"] for one in bill["components"]} == {
        name: version for name, (version, _) in pins("cluster").items()
    }
