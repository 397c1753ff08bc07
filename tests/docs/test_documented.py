"""The documents say what there is: every command, exit status, code, schema and key."""

import ast
import re
from pathlib import Path

import pytest
import typer
from pydantic import BaseModel

from grader.authoring.lint import lint
from grader.authoring.new import new_assignment
from grader.cli.app import app
from grader.cli.exporting import MODELS
from grader.rubric import CriterionTable, RubricFile, ToleranceTable, load_both
from reference.authored import assignment, bodies, mechanism
from reference.construction.mistakes import CODES
from reference.errors import PlanmarkError

ROOT = Path(__file__).resolve().parent.parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
DOCS = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "docs").glob("*.md")}
EVERYTHING = README + "".join(DOCS.values())


def commands() -> set[str]:
    return set(typer.main.get_command(app).commands)


def statuses() -> set[int]:
    found, waiting = {0, 1}, [PlanmarkError]
    while waiting:
        kind = waiting.pop()
        found.add(kind.exit_status)
        waiting.extend(kind.__subclasses__())
    return found


def codes() -> dict[str, str]:
    """Every code that the source gives to an error or a problem, with the file that does.

    Of a code that is put together (``f"{name}_needed"``) the part that stands in the source.
    """
    found = {}
    for source in [*(ROOT / "grader").rglob("*.py"), *(ROOT / "reference").rglob("*.py")]:
        for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and len(node.args) > 1):
                continue
            if node.func.id.lower().endswith(("error", "problem", "failure")):
                code = node.args[1 if node.func.id == "failure" else 0]
                parts = getattr(code, "values", [code])
                texts = [part.value for part in parts if isinstance(part, ast.Constant)]
                found.update({text: source.name for text in texts if re.fullmatch("[a-z_]+", str(text))})
    return found


def test_the_readme_begins_with_the_two_commands_each_one_line():
    lines = [line.strip() for line in README.splitlines() if line.startswith("    ")]
    main_job, tests = lines[:2]
    assert main_job.startswith("python3 -m venv .venv")
    assert main_job.endswith("planmark demo")
    assert "python3 -m venv .venv" in tests
    assert "pytest" in tests
    assert README.index(tests) < README.index("## ")


def test_the_checks_run_the_readmes_own_test_command():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    (pattern,) = re.findall(r"grep -m 1 -E '([^']*)' README\.md", script)
    found = next(line for line in README.splitlines() if re.search(pattern, line))
    assert found.strip() == [line.strip() for line in README.splitlines() if line.startswith("    ")][1]


def test_every_command_is_in_the_readme_and_no_other_is():
    named = set(re.findall(r"(?m)(?:^ +|`|bin/)planmark ([a-z]+)", EVERYTHING))
    assert commands() <= named
    assert named <= commands()


def test_every_option_in_the_readme_is_one_of_its_command():
    shown = re.findall(r"(?m)(?:^ +|`|bin/)planmark ([a-z]+)([^\n`]*)", README)
    known = typer.main.get_command(app).commands
    for command, rest in shown:
        options = {option for parameter in known[command].params for option in parameter.opts}
        assert set(re.findall(r"--[a-z-]+", rest)) <= options | {"--help"}, command


@pytest.mark.parametrize("status", sorted(statuses()))
def test_every_exit_status_is_in_the_readme_and_in_the_list_of_errors(status):
    row = f"\n| {status} | "
    assert row in README
    assert row in DOCS["errors.md"]


def test_every_code_of_an_error_or_problem_is_in_the_list():
    found = codes()
    assert len(found) > 20
    documented = set(re.findall(r"`([a-z_]+)`", DOCS["errors.md"]))
    missing = {
        code: file
        for code, file in found.items()
        if not any(one == code or (code.startswith("_") and one.endswith(code)) for one in documented)
    }
    assert not missing


def test_every_mistake_code_is_explained():
    for code in CODES:
        assert f"`{code}`" in DOCS["formats.md"]


@pytest.mark.parametrize("name", MODELS)
def test_every_schema_is_named_where_its_document_is_described(name):
    assert f"planmark schema {name}" in EVERYTHING


TABLES = [
    mechanism.MechanismFile,
    mechanism.CrankTable,
    mechanism.DyadTable,
    mechanism.SliderTable,
    mechanism.PlateTable,
    mechanism.PointOnLineTable,
    assignment.AssignmentFile,
    assignment.VariantTable,
    assignment.ScalesTable,
    assignment.PageTable,
    assignment.GivenTable,
    bodies.BodyTable,
    bodies.LoadTable,
    RubricFile,
    CriterionTable,
    ToleranceTable,
]


@pytest.mark.parametrize("table", TABLES, ids=lambda table: table.__name__)
def test_every_key_of_an_authored_file_is_described(table: type[BaseModel]):
    words = set(re.findall(r"\w+", DOCS["assignments.md"]))
    assert set(table.model_fields) <= words


def test_force_plans_of_the_page_are_made_as_it_says_and_lint_has_nothing_against_them(tmp_path):
    machine, masses = re.findall(r"```toml\n(.*?)```", DOCS["forces.md"], flags=re.DOTALL)
    (tmp_path / "compressor.mechanism.toml").write_text(machine, encoding="utf-8")
    made = new_assignment(tmp_path / "compressor", mechanism=str(tmp_path / "compressor.mechanism.toml"))
    text = made.assignment.read_text(encoding="utf-8")
    text = re.sub(r"(?m)^(ka = .*)$", r"\1\nkF = 50", text)
    text = re.sub(r"\[\[page\]\].*?(?=\[\[given\]\])", lambda _: masses, text, flags=re.DOTALL)
    made.assignment.write_text(text, encoding="utf-8")
    of_forces = new_assignment(tmp_path / "compressor-forces", like=str(made.assignment))
    found = lint(*load_both(of_forces.assignment))
    assert not found.needs_a_person, found.findings


def test_every_link_within_the_documents_leads_somewhere():
    for name, text in {"README.md": README, **{f"docs/{name}": text for name, text in DOCS.items()}}.items():
        for target in re.findall(r"\]\(([^)#]+)\)", text):
            if not target.startswith("http"):
                assert ((ROOT / name).parent / target).exists(), f"{name}: {target}"
