"""The class sheet: every figure of every variant, in a table and on paper."""

import csv
import io
import math

import numpy as np
import pytest

from grader.authoring.variant_table import class_csv, class_pages, numbered, sections_of, table_pages
from grader.language import tongue
from grader.solution.document import plan_document, plan_documents
from grader.tables.measurements import names_of
from reference.authored.assignment import built_in, load_assignment
from reference.drawing.canvas import A3_MM, Label, bounds
from reference.plan import exact_plan

WRITTEN_DIGITS = 1e-9
"""Ten significant digits are written."""
SAME_WIDTH_MM = 0.5
"""Letters are a little wider or narrower than the table of widths says."""


def whole(name: str):
    assignment = load_assignment(name)
    return assignment, exact_plan(assignment, assignment.variants())


def rows_of(text: str, delimiter: str = ",") -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text), delimiter=delimiter))


@pytest.mark.parametrize("name", built_in())
def test_each_row_of_the_table_is_the_plan_of_its_variant(name):
    assignment, plan = whole(name)
    rows, documents = rows_of(class_csv(plan)), plan_documents(assignment, plan)
    assert len(rows) == len(assignment.variants())
    for index in (0, len(rows) // 2, len(rows) - 1):
        row, document = rows[index], documents[index]
        assert {key: int(row[key]) for key in document.variant} == document.variant
        assert float(row["kv"]) == pytest.approx(document.scales["kv"], rel=WRITTEN_DIGITS)
        for vector, exact in document.vectors.items():
            size = max(one.drawn_mm for one in document.vectors.values())
            assert float(row[vector]) == pytest.approx(exact.drawn_mm, rel=WRITTEN_DIGITS, abs=1e-9 * size)
            if exact.direction_deg is None:
                assert (row[f"{vector}_deg"], row[vector]) == ("", "0")
            else:
                assert float(row[f"{vector}_deg"]) == pytest.approx(exact.direction_deg, abs=1e-6)
        for joint, (x, y) in document.points_m.items():
            assert (float(row[f"x_{joint}"]), float(row[f"y_{joint}"])) == pytest.approx((x, y), abs=1e-9)


def test_columns_are_named_as_in_measurement_files():
    assignment, plan = whole("pump")
    header = next(csv.reader(io.StringIO(class_csv(plan))))
    assert len(header) == len(set(header))
    names = names_of(assignment)
    known = {
        *names.vectors,
        *(f"{name}_deg" for name in names.vectors),
        *(f"{name}_value" for name in names.values),
    }
    other = [name for name in header if name not in known]
    assert other[:4] == ["n", "kL", "kv", "ka"]
    assert all(name.startswith(("x_", "y_")) for name in other[4:])


def test_spreadsheets_with_decimal_commas_get_semicolons():
    _, plan = whole("press")
    dots, commas = rows_of(class_csv(plan)), rows_of(class_csv(plan, decimal_comma=True), ";")
    assert [{key: cell.replace(",", ".") for key, cell in row.items()} for row in commas] == dots
    assert commas[1]["v_B"].startswith("46,399")


def test_a_dead_points_rates_are_zero_and_not_rounding_errors():
    _, plan = whole("press")
    assert rows_of(class_csv(plan))[0]["omega_2_value"] == "0"


def test_the_documents_of_a_class_are_those_of_each_variant():
    assignment, plan = whole("press")
    alone = [
        plan_document(assignment, exact_plan(assignment, [variant])) for variant in assignment.variants()
    ]
    for one, other in zip(plan_documents(assignment, plan), alone, strict=True):
        assert one.position == other.position
        for name, vector in other.vectors.items():
            assert one.vectors[name].drawn_mm == pytest.approx(vector.drawn_mm, abs=1e-9)


def texts(page) -> list[str]:
    return [shape.text for shape in page if isinstance(shape, Label) and isinstance(shape.text, str)]


@pytest.mark.parametrize("name", built_in())
@pytest.mark.parametrize("lang", ["en", "ru"])
def test_every_page_of_tables_stays_on_its_sheet_and_tells_its_variants(name, lang):
    assignment, plan = whole(name)
    pages = numbered(table_pages(assignment, plan, tongue(lang)))
    for number, page in enumerate(pages, 1):
        left, top, right, bottom = bounds(page)
        assert min(left, top) > 5.0
        assert right < A3_MM[0] - 5.0 + SAME_WIDTH_MM
        assert bottom < A3_MM[1] - 3.0
        assert f"{number} / {len(pages)}" in texts(page)
    for section in sections_of(plan):
        for column in (column for block in section.blocks for column in block):
            assert len(column.values) == len(assignment.variants())


def test_the_tables_hold_every_number_to_the_digits_printed():
    assignment, plan = whole("pump")
    words = [text for page in table_pages(assignment, plan, tongue("en")) for text in texts(page)]
    for vector in plan.vectors_si:
        for index in (0, 29):
            assert f"{abs(plan.drawn_mm(vector)[index]):.2f}" in words
            assert f"{plan.direction_deg(vector)[index]:.2f}" in words


def test_a_class_of_hundreds_breaks_its_tables_and_repeats_their_headings(tmp_path):
    text = load_assignment("engine").path.read_text(encoding="utf-8").replace("to = 24", "to = 200")
    (tmp_path / "many.assignment.toml").write_text(text.replace('"15*n - 5"', '"1.5*n"'), encoding="utf-8")
    assignment = load_assignment(tmp_path / "many.assignment.toml")
    plan = exact_plan(assignment, assignment.variants())
    pages = table_pages(assignment, plan, tongue("en"))
    velocity = [page for page in pages if any("Velocities" in text for text in texts(page))]
    numbers = [text for page in velocity for text in texts(page) if text.isdigit()]
    assert [int(text) for text in numbers if 1 <= int(text) <= 200][:200] == list(range(1, 201))
    assert len(velocity) == math.ceil(200 / 44)
    assert all("mm" in texts(page) for page in velocity)


def test_a_drawing_of_each_variant_follows_the_tables_and_is_told():
    assignment, plan = whole("engine")
    tables = table_pages(assignment, plan, tongue("en"))
    told: list[tuple[int, int]] = []
    pages = class_pages(tables, assignment, plan, tell=lambda done, total: told.append((done, total)))
    assert pages[: len(tables)] == tables
    assert len(pages) == len(tables) + 24
    assert told[-1] == (24, 24)
    assert np.diff([done for done, _ in told]).tolist() == [1] * 23
