import itertools
import json

import cv2
import numpy as np
import pypdfium2
import pytest

from grader.language import tongue
from grader.printed import answer_sheet
from grader.printed.answer_sheet import make_calibration, make_sheets
from grader.printed.layout import (
    CODE_MM,
    FRAME_MM,
    MARKER_CORNERS,
    PAGE_MM,
    SCALE_BOXES,
    TEMPLATES,
    Layout,
    best_template,
    calibration_segments,
    cells_of,
    comb_cells,
    extents_mm,
    field_boxes,
    places_mm,
    poles_mm,
    position_zones,
)
from grader.printed.pdf import number, width_mm, wrap
from grader.records import Page, Sheet
from grader.rubric import rubric_of
from grader.scan.register.registration import rectify
from grader.scan.strokes.ink import find_ink
from grader.tables.roster import RosterRow
from grader.texts.spoken import message
from reference.authored.assignment import built_in, load_assignment
from reference.errors import AuthoredFileError
from reference.quantities import zone_of
from tests.rendered import rendered
from tests.told import by_path

A3_POINTS = (420.0 / 25.4 * 72.0, 297.0 / 25.4 * 72.0)
QUIET_MM = 2.0
"""White around a marker: a cell's width."""
FAINT = 200
"""The darkest grey (0..255) printed where students draw: the crosses for the poles."""
LEAST_CELL_MM = 3.5
ANA = RosterRow("s07", "Ana Țîrlea", 7, line=2)
TEN_A_MM = 254.0
"""Dots per inch."""


def page_layouts(assignment, asked=None):
    """The layout of an assignment's pages, without printing any."""
    forms, _ = answer_sheet._forms(assignment, asked)
    return Layout(pages=[answer_sheet._layout(form) for form in forms])


def boxes_of(page):
    figures = {name: box for name, box in page.zones.items() if name != "fields"}
    return {**figures, **page.zones["fields"]}


def overlap(first, second, gap=0.0):
    (x, y, w, h), (u, v, s, t) = first, second
    return x - gap < u + s and u - gap < x + w and y - gap < v + t and v - gap < y + h


def text_of(pdf, page=0):
    return pypdfium2.PdfDocument(pdf)[page].get_textpage().get_text_range()


def rows_for(assignment, **more):
    variant = assignment.variants()[0]
    return [RosterRow("s07", "Ana", variant.n, variant.position, line=2, **more)]


@pytest.mark.parametrize("name", built_in())
def test_every_built_in_assignment_has_true_size_sheets_a_page_for_each_drawing(name):
    assignment = load_assignment(name)
    sheets = make_sheets(assignment, rows_for(assignment))
    document = pypdfium2.PdfDocument(sheets.pdf)
    assert len(document) == len(assignment.file.page) == len(sheets.layout.pages)
    assert all(page.get_size() == pytest.approx(A3_POINTS, abs=0.01) for page in document)
    assert [page.kind for page in sheets.layout.pages] == [table.kind for table in assignment.file.page]


@pytest.mark.parametrize("name", built_in())
def test_markers_zones_and_boxes_lie_inside_the_frame_and_clear_of_each_other(name):
    x, y, w, h = FRAME_MM
    for page in page_layouts(load_assignment(name)).pages:
        boxes = list(boxes_of(page).values())
        squares = [(*marker.corners_mm[0], 12.0, 12.0) for marker in page.markers]
        for box in [*boxes, *squares]:
            assert box[0] > x
            assert box[1] > y
            assert box[0] + box[2] < x + w
            assert box[1] + box[3] < y + h
        for index, box in enumerate(boxes):
            assert not any(overlap(box, other) for other in boxes[index + 1 :])
            assert not any(overlap(box, square, QUIET_MM) for square in squares)


def test_the_layout_is_told_as_the_contract_says():
    told = json.loads(make_sheets(load_assignment("pump"), [ANA]).layout.model_dump_json())
    assert told["page_mm"] == [420, 297]
    velocity, acceleration = told["pages"]
    assert (velocity["kind"], acceleration["kind"]) == ("velocity", "acceleration")
    assert len(velocity["markers"]) == 8
    assert set(velocity["markers"][0]) == {"id", "corners_mm"}
    assert set(velocity["zones"]) == {"mechanism", "velocity_plan", "fields"}
    assert {"kL", "kv", "v_A", "v_DC"} <= set(velocity["zones"]["fields"])
    assert {"kL", "ka", "a_BA_n"} <= set(acceleration["zones"]["fields"])
    assert (
        Layout.model_validate(told).model_dump() == Layout.model_validate_json(json.dumps(told)).model_dump()
    )


@pytest.mark.parametrize(("name", "has_cross"), [("pump", True), ("pump-forces", False)])
def test_a_cross_is_spoken_of_where_one_is_printed(name, has_cross):
    assignment = load_assignment(name)
    sheets = make_sheets(assignment, rows_for(assignment))
    assert ("grey cross" in text_of(sheets.pdf)) == has_cross


def test_what_is_printed_is_where_the_layout_says():
    sheets = make_sheets(load_assignment("pump"), [ANA])
    grey = rendered(sheets.pdf, TEN_A_MM)
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250))
    corners, ids, _ = detector.detectMarkers(grey)
    found = {
        int(number): quad.reshape(4, 2) / 10.0 for number, quad in zip(ids.ravel(), corners, strict=True)
    }
    places = {marker.id: np.array(marker.corners_mm) for marker in sheets.layout.pages[0].markers}
    assert found.keys() == places.keys()
    assert all(np.abs(found[number] - places[number]).max() < 0.2 for number in places)
    for x, y, w, h in (box for name, box in sheets.layout.pages[0].zones.items() if name != "fields"):
        inside = grey[int(y * 10) : int((y + h) * 10), int(x * 10) : int((x + w) * 10)]
        assert inside.min() >= FAINT


def test_boxes_and_cells_to_write_in_are_drawn_where_the_layout_says():
    sheets = make_sheets(load_assignment("pump"), [ANA])
    grey = rendered(sheets.pdf, TEN_A_MM)
    page = sheets.layout.pages[0]
    scales = [box for name, box in page.zones["fields"].items() if name in SCALE_BOXES]
    cells = [cell for cells in page.cells.values() for cell in cells]
    for (x, y, w, h), darkest in [*((box, 100) for box in scales), *((cell, 200) for cell in cells)]:
        inside = grey[
            int((y + 0.4) * 10) : int((y + h - 0.4) * 10), int((x + 0.4) * 10) : int((x + w - 0.4) * 10)
        ]
        assert inside.min() == 255
        assert grey[round((y + h / 2) * 10), round(x * 10) - 1 : round(x * 10) + 2].min() < darkest


@pytest.mark.parametrize("count", [1, 9, 27, 36, 48])
def test_the_cells_of_a_measured_length_fill_its_box_and_stay_apart(count):
    for x, y, w, h in field_boxes(tuple(map(str, range(count)))).values():
        cells = comb_cells((x, y, w, h))
        assert len(cells) == 4
        assert cells[0][0] == pytest.approx(x, abs=0.01)
        assert cells[-1][0] + cells[-1][2] == pytest.approx(x + w, abs=0.01)
        assert all(second[0] - first[0] - first[2] > 0.5 for first, second in itertools.pairwise(cells))
        assert all(cell[2] >= LEAST_CELL_MM and cell[3] >= LEAST_CELL_MM for cell in cells)


def test_only_what_is_asked_for_has_a_box_and_it_stays_where_it_is_when_more_is_asked():
    pump = load_assignment("pump")
    few, many = (page_layouts(pump, asked).pages[1] for asked in ({"a_D"}, {"a_D", "a_B", "v_B"}))
    assert set(few.cells) == {"a_D"}
    assert set(many.cells) == {"a_D", "a_B"}
    assert few.cells["a_D"] == many.cells["a_D"] == page_layouts(pump).pages[1].cells["a_D"]
    assert set(few.zones["fields"]) == {"kL", "ka", "a_D"}


@pytest.mark.parametrize("name", built_in())
def test_a_plan_begun_at_the_printed_cross_is_in_the_middle_of_its_zone(name):
    assignment = load_assignment(name)
    variants = assignment.variants()
    for table in assignment.file.page:
        template = best_template(assignment, table.figures).template
        for figure, poles in poles_mm(assignment, template, variants).items():
            own = position_zones(assignment, template.zones)
            places = places_mm(assignment, [figure], variants)[figure]
            for column, (px, py) in enumerate(poles):
                x, y, w, h = own.get(variants[column].position, template.zones[figure])
                drawn = complex(px, -py) + places[:, column]
                left, right = drawn.real.min() - x, x + w - drawn.real.max()
                above, below = -y - drawn.imag.max(), drawn.imag.min() + y + h
                assert left == pytest.approx(right, abs=0.01)
                assert above == pytest.approx(below, abs=0.01)
                assert min(left, above) >= 11.99


def test_one_sheet_has_the_numbered_zones_and_poles_of_all_positions():
    assignment = load_assignment("press-all")
    rows = [RosterRow("s01", "Ana", position=position) for position in assignment.shared_positions]
    sheets = make_sheets(assignment, [*rows, RosterRow("s02", "Ion", position=3)])
    mechanism, velocity = sheets.layout.pages
    assert len(pypdfium2.PdfDocument(sheets.pdf)) == 4
    assert set(mechanism.positions.values()) == {mechanism.zones["mechanism"]}
    boxes = list(velocity.positions.values())
    assert list(velocity.positions) == list(range(8))
    assert not any(overlap(*pair, gap=3.9) for pair in itertools.combinations(boxes, 2))
    text = text_of(sheets.pdf, 1)
    assert all(f"p{position}" in text and f"position = {position}" in text for position in range(8))
    # The crank's angle is another in each position: it is no datum of the sheet.
    assert "φ" not in text
    assert "φ" in text_of(sheets.pdf, 3)


def test_the_students_data_are_printed_in_words():
    text = text_of(make_sheets(load_assignment("pump"), [ANA]).pdf)
    for told in ("Ana Țîrlea", "s07", "n = 7", "44°", "370 rev/min", "sheet 1 of 2", "Determine graphically"):
        assert told in text.replace("\r\n", " ").replace("\N{NO-BREAK SPACE}", " "), told


def test_a_student_reads_the_task_in_the_language_on_the_roster():
    assignment = load_assignment("press")
    text = text_of(make_sheets(assignment, rows_for(assignment, lang="ru"), "en").pdf)
    assert "Постройте механизм" in text
    assert "23,5" in text
    assert "6,01" not in text


def test_names_that_the_assignment_changes_are_printed_so():
    assignment = load_assignment("press")
    assert "μ" in text_of(make_sheets(assignment, rows_for(assignment)).pdf)


def test_every_row_that_does_not_suit_the_assignment_is_told():
    rows = [RosterRow("s1", n=None, line=2), RosterRow("s2", n=3, line=3), RosterRow("s3", n=99, line=4)]
    with pytest.raises(AuthoredFileError) as caught:
        make_sheets(load_assignment("pump"), rows, roster="class.csv")
    assert list(by_path(caught.value.findings)) == ["line 2, s1", "line 4, s3"]
    assert "class.csv" in str(caught.value)


def test_the_same_input_gives_the_same_file():
    assignment = load_assignment("pump")
    assert make_sheets(assignment, [ANA]).pdf == make_sheets(assignment, [ANA]).pdf


@pytest.mark.parametrize("name", built_in())
def test_a_figure_that_does_not_fit_its_zone_is_told_and_no_other(name):
    assignment = load_assignment(name)
    told = {
        (p.parameters["form"], p.parameters["figure"])
        for p in make_sheets(assignment, rows_for(assignment)).problems
    }
    expected = set()
    for table in assignment.file.page:
        template = best_template(assignment, table.figures).template
        for figure, (wide, high) in extents_mm(assignment, table.figures, assignment.variants()).items():
            if zone_of(figure) != figure:
                continue
            _, _, zone_wide, zone_high = template.zones[figure]
            if wide.max() + 24.0 > zone_wide or high.max() + 24.0 > zone_high:
                expected.add((table.kind, figure))
    assert told == expected


def test_the_templates_numbers_are_what_printed_sheets_rely_on():
    # Printed sheets outlive the program: a number must always mean the same division.
    assert TEMPLATES[4].zones == {
        "mechanism": (23.0, 51.0, 152.0, 212.0),
        "velocity_plan": (179.0, 51.0, 228.0, 212.0),
    }
    assert TEMPLATES[11].zones == {
        "mechanism": (23.0, 51.0, 190.0, 212.0),
        "acceleration_plan": (217.0, 51.0, 190.0, 212.0),
    }
    assert TEMPLATES[27].zones["acceleration_plan"] == (236.0, 148.6, 171.0, 114.4)
    assert TEMPLATES[28].zones == {
        "mechanism": (23.0, 51.0, 136.8, 212.0),
        "force_plans": (163.8, 51.0, 243.2, 212.0),
    }
    assert TEMPLATES[29].zones == {"force_plans": (23.0, 51.0, 384.0, 212.0)}
    assert len(TEMPLATES) == 30


@pytest.mark.parametrize("template", TEMPLATES, ids=lambda template: str(template.number))
def test_the_zones_of_a_template_do_not_meet(template):
    boxes = list(template.zones.values())
    assert not any(overlap(box, other) for index, box in enumerate(boxes) for other in boxes[index + 1 :])


@pytest.mark.parametrize("count", [0, 1, 9, 10, 18, 19, 27, 36, 48])
def test_boxes_for_lengths_are_as_many_as_asked_and_stay_apart(count):
    boxes = list(field_boxes(tuple(map(str, range(count)))).values())
    assert len(boxes) == count
    assert not any(overlap(box, other) for index, box in enumerate(boxes) for other in boxes[index + 1 :])
    squares = [(*corners[0], 12.0, 12.0) for corners in MARKER_CORNERS.tolist()]
    assert not any(overlap(box, square, QUIET_MM) for box in boxes for square in squares)
    assert not any(overlap(box, scale) for box in boxes for scale in SCALE_BOXES.values())


def test_more_lengths_than_there_is_room_for_get_no_boxes():
    assert field_boxes(tuple(map(str, range(49)))) == {}


def test_the_calibration_page_has_its_segments_inside_the_page():
    segments = calibration_segments()
    assert segments.min() > 20.0
    assert (segments.max(axis=(0, 1)) < np.array(PAGE_MM) - 20.0).all()
    sheets = make_calibration("ro")
    assert len(pypdfium2.PdfDocument(sheets.pdf)) == 1
    assert sheets.layout.pages[0].kind == "calibration"


def test_the_segments_of_the_calibration_page_are_inked_from_end_to_end_and_not_beyond():
    grey = rendered(make_calibration().pdf, TEN_A_MM)
    for start, end in calibration_segments():
        along = (end - start) / np.hypot(*(end - start))
        for place, dark in (
            (start + 0.3 * along, True),
            (end - 0.3 * along, True),
            (start - along, False),
            (end + along, False),
        ):
            column, row = (place * 10 - 0.5).round().astype(int)
            assert (grey[row, column] < 128) == dark


@pytest.mark.parametrize(
    ("value", "lang", "told"),
    [
        (1350.0, "en", "1350"),
        (6.015817, "ru", "6,01582"),
        (0.3, "ro", "0,3"),
        (1234567.0, "en", "1234567"),
        (0.00002, "en", "0.00002"),
    ],
)
def test_data_are_written_as_people_write_them(value, lang, told):
    assert number(value, tongue(lang).decimal_mark) == told


def test_lines_are_never_wider_than_the_box():
    text = "Определите графически скорость и ускорение поршня " + "W" * 80
    lines = wrap(text, "DejaVuSansCondensed", 8.0, 60.0)
    assert all(width_mm(line, "DejaVuSansCondensed", 8.0) <= 60.0 for line in lines)
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")


def test_letters_that_the_font_lacks_are_told_and_the_languages_are_complete():
    rows = [
        RosterRow("s1", "王 Ana", 1, line=2),
        RosterRow("s2", "ĂÂÎȘȚăâîșțŞŢşţ Ёё Щщ Ґґ Її ωπφμ", 2, line=3),
    ]
    (problem,) = make_sheets(load_assignment("pump"), rows).problems
    assert problem.code == "sheet_letters"
    assert "Line 2" in message(problem)
    assert "王" in message(problem)


@pytest.mark.parametrize("lang", ["en", "ro", "ru"])
def test_long_names_and_ids_stay_in_their_column(lang):
    sheets = make_sheets(
        load_assignment("pump"), [RosterRow("W" * 64, "Wolfeschlegelsteinhausen " * 6, 30)], lang
    )
    grey = rendered(sheets.pdf, TEN_A_MM)
    # The quiet zone of the marker beside the column, and the line between data and advice.
    assert grey[110:280, int(142.2 * 10) : int(143.8 * 10)].min() == 255
    assert grey[370:378, 380:1430].min() == 255


def test_the_faint_crosses_are_no_strokes_on_a_scan():
    sheets = make_sheets(load_assignment("pump"), [ANA])
    page = Page("blank.png", 1, rendered(sheets.pdf, 300, 1), (300.0, 300.0))
    sheet = rectify(page)
    assert isinstance(sheet, Sheet)
    zones = [box for box in sheets.layout.pages[1].zones.values() if isinstance(box, tuple)]
    ink = find_ink(page, sheet, zones)
    assert len(ink.strokes) == len(ink.circles) == 0


@pytest.mark.parametrize("asked", [None, {"a_D", "v_D"}])
def test_the_cells_of_a_scanned_page_are_those_that_were_printed(asked):
    pump = load_assignment("pump")
    for page in page_layouts(pump, asked).pages:
        figures = [name for name in page.zones if name != "fields"]
        assert cells_of(pump, figures, asked) == page.cells
    assert cells_of(pump, ["mechanism"], asked) == {}


# Computed values ----------------------------------------------------------------------------------


def values_on(name):
    """The layout of an assignment's pages with all that its rubric asks for."""
    assignment = load_assignment(name)
    return page_layouts(assignment, rubric_of(assignment).entries).pages


@pytest.mark.parametrize(
    ("name", "velocities", "accelerations", "decimals"),
    [("press", ["v_B", "v_BA", "v_C", "v_D", "v_DC"], [], 3), ("pump", ["v_D"], ["a_D"], 2)],
)
def test_values_asked_for_have_places_that_meet_nothing_else(name, velocities, accelerations, decimals):
    pages = values_on(name)
    assert [list(page.values) for page in pages] == [velocities, accelerations]
    assert pages[0].values["v_D"].decimals == decimals
    for page in pages:
        markers = [(*marker.corners_mm[0], 12.0, 12.0) for marker in page.markers]
        taken = [*boxes_of(page).values(), *markers]
        for place in page.values.values():
            x, y, wide, high = place.box
            assert FRAME_MM[0] < x < x + wide < FRAME_MM[0] + FRAME_MM[2]
            assert FRAME_MM[1] < y < y + high < FRAME_MM[1] + FRAME_MM[3]
            assert min(min(cell[2:]) for cell in place.cells) >= LEAST_CELL_MM
            others = [one.box for one in page.values.values() if one is not place]
            assert not any(overlap(place.box, other, 0.5) for other in (*taken, *others))


@pytest.mark.parametrize("name", ["pump-forces", "press-forces"])
def test_a_moment_has_cells_and_a_box_for_each_sense_after_the_force_plans(name):
    *others, page = values_on(name)
    assert not any(one.values for one in others)
    place = page.values["M_b"]
    assert (place.decimals, len(place.senses)) == (0, 2)
    markers = [(*marker.corners_mm[0], 12.0, 12.0) for marker in page.markers]
    taken = [*boxes_of(page).values(), *markers, CODE_MM]
    boxes = [place.box, *place.senses]
    assert not any(overlap(box, other, 0.5) for box in boxes for other in taken)
    assert not any(overlap(*pair, 3.0) for pair in itertools.combinations(boxes, 2))


def test_values_leave_the_rest_of_a_sheet_as_it_is():
    pump = load_assignment("pump")
    rubric = rubric_of(pump)
    with_values, without = (page_layouts(pump, asked).pages for asked in (rubric.entries, rubric.vectors))
    assert [page.model_copy(update={"values": {}}) for page in with_values] == without
    engine = load_assignment("engine")
    asked = rubric_of(engine)
    pdfs = [make_sheets(engine, rows_for(engine), asked=one).pdf for one in (asked.entries, asked.vectors)]
    assert pdfs[0] == pdfs[1]


def test_values_without_room_are_told_and_none_is_printed():
    pump = load_assignment("pump")
    asked = [*rubric_of(pump).vectors, "a_D_value", "a_C_value"]
    sheets = make_sheets(pump, [ANA], asked=asked)
    (problem,) = [one for one in sheets.problems if one.code == "sheet_values"]
    assert problem.parameters["values"] == ("a_C", "a_D")
    assert not any(page.values for page in sheets.layout.pages)
