"""The platforms' importers of files, written from their documentation and behaviour."""

import csv
import io
import re
import zipfile
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import pairwise

CANVAS_NUMBER = re.compile(r"-?[0-9.,]+%?")


@dataclass
class MoodleSite:
    """An assignment of a Moodle site: what it holds by participant, and what an import changed.

    `strings` are the headings and the word for a participant in the teacher's language pack; `grades`
    are the grade and the time of its last change.
    """

    maximum: float
    grades: dict = field(default_factory=dict)
    comments: dict = field(default_factory=dict)
    strings: tuple = ("Identifier", "Grade", "Last modified (grade)", "Feedback comments", "Participant ")
    decimal_mark: str = "."
    passes_over_zero: bool = False
    updated: int = 0
    commented: int = 0

    def upload(self, data):
        """Moodle 4.5: offline/importgradeslib.php, assignfeedback_offline_grade_importer::init and next,
        and offline/locallib.php, assign_feedback_offline::process_import_grades.
        """
        header, *rows = csv.reader(io.StringIO(data.decode("utf-8-sig"), newline=""))
        identifier, grade, modified, feedback, word = self.strings
        # Headings are compared as they are; a column of comments at place 0 is empty() to PHP.
        who, what, when = (header.index(each) for each in (identifier, grade, modified))
        told = header.index(feedback) if feedback in header else 0
        for row in filter(None, rows):
            number = row[who][len(word) :]
            if number.isdigit():
                self.import_row(int(number), row[what], strtotime(row[when]), row[told] if told else None)
        return self

    def import_row(self, participant, text, modified, comment):
        value = unformat_float(text, self.decimal_mark)
        held, changed = self.grades.get(participant, (None, None))
        is_stale = changed is not None and changed > modified + 60
        is_same = held is not None and held == value
        is_none = value is None or value < 0 or (self.passes_over_zero and not value)
        if not (is_same or is_none or is_stale or value > self.maximum):
            self.grades[participant] = (value, NOW)
            self.updated += 1
        if comment is not None and not is_stale and comment != self.comments.get(participant, ""):
            self.comments[participant] = comment
            self.commented += 1


NOW = datetime(2026, 11, 22, tzinfo=UTC).timestamp()


def unformat_float(text, decimal_mark):
    """Moodle 4.5: lib/moodlelib.php, unformat_float; PHP casts a text's leading digits, else 0."""
    text = text.strip().replace(" ", "").replace(decimal_mark, ".")
    leading = re.match(r"-?[0-9]*\.?[0-9]*", text)[0]
    return None if not text else float(leading) if any(map(str.isdigit, leading)) else 0.0


def strtotime(text):
    """Seconds since 1970; 0 where PHP's strtotime knows none of the words. The site's zone is UTC.

    Moodle writes dates in the user's zone and reads those without one in the site's: lib/classes/date.php,
    get_user_timezone and set_default_server_timezone.
    """
    for form in ("%A, %d %B %Y, %I:%M %p", "%Y-%m-%dT%H:%M:%S%z", "%Y-%m-%d %H:%M"):
        with suppress(ValueError):
            read = datetime.strptime(text, form)  # noqa: DTZ007 - the zone is added below
            return (read if read.tzinfo else read.replace(tzinfo=UTC)).timestamp()
    return 0


def moodle_gradebook(text, users, existing=None):
    """Grades by user, with feedback in an item that is there, of a maximum; an error aborts all.

    Moodle 4.5: grade/import/csv/classes/load_data.php, gradeimport_csv_load_data: a new item is out of
    100, and feedback can be mapped to items that are there alone (map_user_data_with_value, 'feedback').
    """
    _, *rows = csv.reader(io.StringIO(text, newline=""))
    stored = {}
    for row in rows:
        grade = None if row[1].strip() in {"", "-"} else float(row[1])
        if row[0] not in users or (grade is not None and grade > (existing or 100.0)):
            return {}
        stored[row[0]] = (grade, row[2]) if existing else grade
    return stored


def moodle_feedback(data, participants, least=4):
    """Files by participant: a path's part with three underscores says whose and for which plugin.

    Moodle 4.5: feedback/file/importziplib.php, assignfeedback_file_zip_importer: `least` is how many parts
    it needs between underscores, 5 from 3.1 to 4.0, then 4. Before 3.1 it looked at files' own names alone.
    Where students hand in as groups, get_participant_mapping gives groups' numbers instead of `participants`.
    """
    stored = {}
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for name in archive.namelist():
            parts = name.split("/")
            while parts:
                part, *parts = parts
                info = part.split("_", 4)
                if len(info) >= least and info[1].isdigit() and int(info[1]) in participants:
                    assert info[2:4] == ["assignfeedback", "file"]
                    rest = "/".join([*info[4:5], *parts]).lstrip("/")
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


def canvas_rating(ratings, points):
    """The name of the rating that Canvas shows for points in a range: the first that fits.

    app/models/rubric_association.rb, assess; ratings are sorted by points (rubric.rb, generate_criteria).
    """
    ranges = pairwise([*sorted(ratings, key=lambda one: -one[1]), ("", 0.0)])
    fitting = [name for (name, most), (_, below) in ranges if most == points or most > points > below]
    return next(iter(fitting), None)


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
