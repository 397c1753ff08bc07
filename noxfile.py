"""The handful of commands: `pip install -e ".[dev]" nox`, then `nox -s NAME` in that environment."""

import nox

nox.options.default_venv_backend = "none"
nox.options.sessions = ["lint", "quick"]
ONE_THREAD = {"OMP_NUM_THREADS": "1"}
"""Tests run side by side: each library's own threads would only get in each other's way."""


@nox.session
def lint(session: nox.Session) -> None:
    """Style, types, and the direction of imports."""
    session.run("ruff", "check", ".")
    session.run("ruff", "format", "--check", ".")
    session.run("mypy")
    session.run("lint-imports")


QUICK = ("comparison", "cycle", "given_data", "language", "lms", "older", "printed", "reference", "tables")
"""Rooms that need no pictures: 1,900 tests in under a minute."""


@nox.session
def quick(session: nox.Session) -> None:
    """The quick tests, or those named: nox -s quick -- tests/unit/review."""
    chosen = session.posargs or [f"tests/unit/{room}" for room in QUICK]
    session.run("pytest", "-q", "-n", "2", "-m", "not slow", *chosen, env=ONE_THREAD)


@nox.session
def tests(session: nox.Session) -> None:
    """All tests, laws with all their examples."""
    session.run("pytest", "-q", "-n", "2", *session.posargs, env={**ONE_THREAD, "HYPOTHESIS_PROFILE": "full"})


@nox.session
def translations(session: nox.Session) -> None:
    """The texts of the code into the catalogues, and these compiled."""
    catalogue, folder = "grader/locale/planmark.pot", "grader/locale"
    plain = ("--no-wrap",)
    words = ("-F", "grader/locale/babel.cfg", "-k", "N_", "--no-location", "--sort-output")
    session.run("pybabel", "extract", *words, *plain, "-o", catalogue, ".")
    update = ("-D", "planmark", "-i", catalogue, "-d", folder, "--no-fuzzy-matching", "--ignore-obsolete")
    session.run("pybabel", "update", *update, *plain)
    session.run("pybabel", "compile", "-D", "planmark", "-d", folder)


STACKS = ("web", "cluster")
"""The extras whose versions are held, with hashes, in `constraints`."""


@nox.session
def constraints(session: nox.Session) -> None:
    """The versions of the web's and the cluster's stacks, with the hashes of their files."""
    plain = ("--strip-extras", "--no-emit-index-url", "--no-emit-find-links", "--no-header", "--no-annotate")
    for stack in STACKS:
        extras = ("--extra", stack, "--extra", "plots")
        out = ("-o", f"constraints/{stack}.txt", "pyproject.toml")
        session.run("pip-compile", "--quiet", "--generate-hashes", *plain, *extras, *out)


@nox.session
def sbom(session: nox.Session) -> None:
    """Bills of materials of both stacks, as CycloneDX: `sbom-web.json` and `sbom-cluster.json`."""
    for stack in STACKS:
        known = ("--pyproject", "pyproject.toml", "--output-reproducible")
        session.run(
            "cyclonedx-py", "requirements", f"constraints/{stack}.txt", *known, "-o", f"sbom-{stack}.json"
        )


@nox.session
def bench(session: nox.Session) -> None:
    """The benchmarks of solver and reading."""
    session.run("python", "-m", "tests.bench", *session.posargs, env=ONE_THREAD)


@nox.session
def docs(session: nox.Session) -> None:
    """The documentation as a site, in the folder `site`."""
    session.run("mkdocs", "build", "--strict", *session.posargs)
