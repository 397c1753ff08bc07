"""What the platforms' importers do with a file, written from their documentation and behaviour."""

import csv
import io
import re
import zipfile

CANVAS_NUMBER = re.compile(r"-?[0-9.,]+%?")


def moodle_worksheet(data, maximum, word="Participant "):
    """Grades and comments by participant, as Moodle stores them; who is skipped is not there."""
    header, *rows = csv.reader(io.StringIO(data.decode("utf-8-sig"), newline=""))
    stored = {}
    for row in (row for row in rows if row):
        cells = dict(zip(header, row, strict=True))
        grade = cells["Grade"].replace(" ", "")
        if not cells["Identifier"].startswith(word) or grade in {"", "-"}:
            continue
        # PHP's cast of a text to a number: its leading digits, else 0.
        leading = re.match(r"-?[0-9]*\.?[0-9]*", grade)
        value = float(leading[0] or 0) if leading else 0.0
        if 0.0 <= value <= maximum:
            place = header.index("Feedback comments") if "Feedback comments" in header else 0
            comment = row[place] if place else None
            stored[int(cells["Identifier"][len(word) :])] = (value, comment)
    return stored


def moodle_gradebook(text, users, column=1):
    """Grades by user of a new grade item; one unknown user aborts all."""
    _, *rows = csv.reader(io.StringIO(text, newline=""))
    stored = {}
    for row in rows:
        if row[0] not in users:
            return {}
        # A blank is stored as 0 in a new item, and only a dash is none.
        stored[row[0]] = None if row[column].strip() == "-" else float(row[column] or 0)
    return stored


def moodle_feedback(data, participants):
    """Files by participant: a path's part with three underscores says whose and for which plugin."""
    stored = {}
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for name in archive.namelist():
            parts = name.split("/")
            while parts:
                part, *parts = parts
                info = part.split("_", 4)
                if len(info) >= 4 and info[1].isdigit() and int(info[1]) in participants:
                    assert info[2:4] == ["assignfeedback", "file"]
                    rest = "/".join([*info[4:5], *parts])
                    stored.setdefault(int(info[1]), {})[rest] = archive.read(name)
                    break
    return stored


def canvas_cell(text):
    """The last comma or dot of a number is its decimal mark, the others go."""
    if not CANVAS_NUMBER.fullmatch(text):
        return text
    *whole, last = re.split("[.,]", text)
    return f"{''.join(whole)}.{last}" if whole else last


def canvas_gradebook(text, assignment, by_id=(), by_sis=(), by_login=(), by_name=()):
    """Grades by user and the points possible; columns by their places, users by the first that fits."""
    rows = [[canvas_cell(cell) for cell in row] for row in csv.reader(io.StringIO(text, newline=""))]
    header = rows[0]
    assert "Student" in header[0]
    assert "ID" in header[1]
    assert "SIS User ID" in header[2]
    assert "SIS Login ID" in header[3]
    assert "Section" in header[4]
    column = header.index(assignment)
    possible, stored = None, {}
    for row in rows[1:]:
        if "Points Possible" in row[0]:
            possible = float(row[column])
        elif any(cell.strip() and not cell.startswith("Manual Posting") for cell in row):
            known = (by_id, row[1]), (by_sis, row[2]), (by_login, row[3]), (by_name, row[0])
            who = next((dict(users)[cell] for users, cell in known if cell in dict(users)), None)
            stored[who] = row[column].strip()
    return possible, stored


def canvas_rubric(text):
    """Criteria with ratings by rubric's name; a blank name of a rating ends them."""
    header, *rows = csv.reader(io.StringIO(text, newline=""))
    assert header[0] == "Rubric Name"
    names = [place for place, title in enumerate(header) if title == "Rating Name"]
    stored = {}
    for row in rows:
        ratings = [(row[place], round(float(row[place + 2].replace(",", ".")), 2)) for place in names]
        is_range = row[header.index("Criteria Enable Range")].lower() in {"true", "1"}
        stored.setdefault(row[0], []).append((row[1], is_range, ratings))
    return stored
