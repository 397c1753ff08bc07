"""Moodle stores the exported files as meant: first import, regrade, languages, zero, groups.

Rules are those of Moodle 4.5 and stand in `importers`, each with its file and function. Headings and words
are those of Moodle's language packs: assign.php (recordid, hiddenuser, gradenoun, maxgrade, submissionteam,
gradecanbechanged, lastmodifiedgrade), moodle.php and assignfeedback_comments.php of each language.
"""

import csv
import io
import os
from datetime import UTC, datetime

import pytest

from grader.lms.grades import Person
from grader.lms.moodle import Worksheet
from grader.lms.table import csv_text
from reference.errors import CallError, InputFileError
from tests.unit.lms import importers
from tests.unit.lms.classroom import moodle, notes, report
from tests.unit.lms.importers import MoodleSite

ENGLISH = {
    "header": (
        "Identifier", "Full name", "Email address", "Status", "Grade", "Maximum grade",
        "Grade can be changed", "Last modified (submission)", "Last modified (grade)", "Feedback comments",
    ),
    "word": "Participant ", "no": "No", "mark": ".", "date": "Monday, 2 March 2026, 10:15 AM",
}  # fmt: skip


def pack(word, no, date, *header, mark=","):
    return {"header": header, "word": word, "no": no, "mark": mark, "date": date}


LANGUAGES = {
    "en": ENGLISH,
    "ro": pack(
        "Participant", "Nu", "luni, 2 martie 2026, 10:15", "Identificator", "Nume complet",
        "Adresa de e-mail", "Status", "Notă", "Notă maximă", "Nota poate fi schimbată",
        "Ultima modificare (a răspunsului)", "Ultima modificare (nota)", "Comentarii de feedback",
    ),
    "ru": pack(
        "Участник", "Нет", "понедельник, 2 марта 2026, 10:15", "Идентификатор", "Полное имя",
        "Адрес электронной почты", "Статус", "Оценка", "Максимальная оценка", "Оценка может быть изменена",
        "Последнее изменение (ответ)", "Последнее изменение (оценка)", "Отзыв в виде комментария",
    ),
    "de": pack(
        "Teilnehmer/in", "Nein", "Montag, 2. März 2026, 10:15", "ID", "Vollständiger Name",
        "E-Mail-Adresse", "Status", "Bewertung", "Bestwertung", "Bewertung kann geändert werden",
        "Zuletzt geändert (Abgabe)", "Zuletzt geändert (Bewertung)", "Feedback als Kommentar",
    ),
    "fr": pack(
        "Participant", "Non", "lundi 2 mars 2026, 10:15", "Identifiant", "Nom complet",
        "Adresse de courriel", "Statut", "Note", "Note maximale", "La note peut être modifiée",
        "Dernière modification (travail remis)", "Dernière modification (note)",
        "Feedback par commentaires",
    ),
    "uk": pack(
        "Учасник", "Ні", "понеділок 2 березня 2026 10:15", "Ідентифікатор", "Повна назва",
        "Електронна пошта", "Статус", "Оцінка", "Максимальна оцінка", "Оцінка може бути змінена",
        "Востаннє змінювалося (здача)", "Востаннє змінювалося (оцінка)", "Відгук - коментарем",
    ),
    "tr": pack(
        "Katılımcı", "Hayır", "Pazartesi, 2 Mart 2026, 10:15", "Tanımlayıcı", "Tam adı",
        "E-posta adresi", "Durum", "Not", "Enyüksek not", "Not değiştirilebilir",
        "Son düzenleme (gönderim)", "Son düzenleme (not)", "Geri bildirim yorumları",
    ),
    "el": pack(
        "Συμμετέχων", "Όχι", "Δευτέρα, 2 Μαρτίου 2026, 10:15", "Αναγνωριστικό", "Πλήρες όνομα",
        "Διεύθυνση ηλε.ταχυδρομείου", "Κατάσταση", "Βαθμός", "Μέγιστος Βαθμός",
        "Ο βαθμός μπορεί να αλλάξει", "Τελευταία τροποποιημένη (υποβολή)",
        "Τελευταία τροποποίηση (βαθμολόγηση)", "Σχόλια ανατροφοδότησης",
    ),
    "ar": pack(
        "المشارك", "لا", "الاثنين، 2 مارس 2026، 10:15", "المُعرَّف", "ًالاسم كاملا",
        "عنوان البريد الإلكتروني", "الحالة", "الدرجة", "أعلى تقدير", "يمكن تغيير الدرجة",
        "آخر تعديل (التسليم)", "آخر تعديل (التقدير)", "تعليقات الإفادة", mark=".",
    ),
    "ja": pack(
        "参加者", "No", "2026年 03月 2日(月曜日) 10:15", "ID", "フルネーム", "メールアドレス", "ステータス",
        "評点", "最大評点", "評点変更可", "最終更新日時 (提出)", "最終更新日時 (評定)",
        "フィードバックコメント", mark=".",
    ),
    "zh_cn": pack(
        "参与人", "否", "2026年03月2日 星期一 10:15", "标识符", "全名", "电子邮件地址", "状态", "成绩",
        "最高分", "允许更改成绩", "上次修改（作业）", "上次修改（评分）", "反馈意见", mark=".",
    ),
}  # fmt: skip
HELD = datetime(2026, 3, 2, 10, 15, 20, tzinfo=UTC).timestamp()
DOWNLOADED = datetime(2026, 3, 2, 12, 0, tzinfo=UTC).timestamp()
PEOPLE = {f"s{at}": Person(name=f"Ion Popescu {at}", email=f"s{at}@x.ro") for at in range(1, 24)}


def site_of(language, **more):
    who, _, _, _, grade, _, _, _, modified, comment = language["header"]
    strings = (who, grade, modified, comment, language["word"])
    return MoodleSite(10.0, strings=strings, decimal_mark=language["mark"], **more)


def download(site, language, *, locked=(), team=None, maximum="10.00", people=PEOPLE):
    """A worksheet. Moodle 4.5: mod/assign/gradingtable.php, assign_grading_table::__construct."""

    def in_form(text):
        return f'"{text.replace(".", language["mark"])}"'

    lines = []
    for at, who in enumerate(people.values(), start=1):
        held = in_form(f"{site.grades[at][0]:.2f}") if at in site.grades else ""
        date = f'"{language["date"]}"' if at in site.grades else "-"
        can_be_changed = language["no"] if at in locked else "Yes"
        group = [] if team is None else [f"{team} {at % 6}"]
        cells = [
            f"{language['word']}{at}", who.name, who.email, "Submitted", *group, held, in_form(maximum),
            can_be_changed, f'"{language["date"]}"', date, site.comments.get(at, ""),
        ]  # fmt: skip
        lines.append(",".join(cells))
    header = list(language["header"])
    if team is not None:
        header.insert(4, team)
    return "\r\n".join([",".join(header), *lines, ""]).encode()


def exported(tmp_path, data, *reports, what="grades", written=DOWNLOADED, **how):
    form = tmp_path / "worksheet.csv"
    form.write_bytes(data)
    os.utime(form, (written, written))
    name = "o.zip" if what == "feedback" else "o.csv"
    delivery, path = moodle(
        tmp_path, what, *reports, name=name, form=form, out=tmp_path, **{"people": PEOPLE, **how}
    )
    return path.read_bytes(), " / ".join(notes(delivery)), delivery


def a_class(score=7.25):
    return [report(f"s{at}", score) for at in range(1, 24)]


@pytest.mark.parametrize("language", LANGUAGES.values(), ids=LANGUAGES)
def test_the_first_import_stores_every_grade_in_every_language(tmp_path, language):
    site = site_of(language)
    data, noted, delivery = exported(tmp_path, download(site, language, locked=[23]), *a_class())
    site.upload(data)
    assert {at: grade for at, (grade, _) in site.grades.items()} == dict.fromkeys(range(1, 23), 7.25)
    assert (site.updated, site.commented, list(delivery.unplaced)) == (22, 22, ["s23"])
    assert "Moodle reports must be 22" in noted


@pytest.mark.parametrize("language", LANGUAGES.values(), ids=LANGUAGES)
def test_a_regrade_updates_every_grade_in_every_language(tmp_path, language):
    site = site_of(language, grades=dict.fromkeys(range(1, 24), (4.0, HELD)))
    as_it_was = download(site, language)
    data, noted, _ = exported(tmp_path, as_it_was, *a_class())
    assert site.upload(data).updated == 23
    assert "Moodle reports must be 23" in noted
    is_known = language in (ENGLISH, LANGUAGES["ro"], LANGUAGES["ru"])
    assert ("they are written as the file's time, 2026-03-02 12:00" in noted) != is_known


@pytest.mark.parametrize("code", ["ro", "ru", "de"])
def test_a_grade_that_a_colleague_gave_after_the_download_stays(tmp_path, code):
    """The file is copied after that, which sets its time; in a language that is not known it must not be."""
    language, between = LANGUAGES[code], DOWNLOADED + 3600
    site = site_of(language, grades=dict.fromkeys(range(1, 20), (4.0, HELD)))
    copied = DOWNLOADED if code == "de" else between + 3600
    data, _, _ = exported(tmp_path, download(site, language), *a_class(), written=copied)
    given = {5: (9.0, between), 22: (9.0, between)}
    site.grades |= given
    assert site.upload(data).updated == 21
    assert {at: site.grades[at] for at in given} == given


def test_who_is_withheld_keeps_the_digits_of_a_grade_and_the_link_in_a_comment(tmp_path):
    """The worksheet has two decimals of a grade and a comment without its links: both would be changes."""
    link = '<a href="https://example.org">see</a>'
    site = site_of(ENGLISH, grades={1: (6.66667, HELD)}, comments={1: link})
    sheet = download(site, ENGLISH).replace(link.encode(), b"see")
    waiting = report("s1", None, status="needs_review")
    data, noted, _ = exported(tmp_path, sheet, waiting, *a_class()[1:])
    site.upload(data)
    assert (site.grades[1], site.comments[1]) == ((6.66667, HELD), link)
    assert "withheld, and a grade is there already, which stays: s1 (6.67)" in noted
    as_before = site_of(ENGLISH, grades={1: (6.66667, HELD)}, comments={1: link}).upload(sheet)
    assert (as_before.updated, as_before.comments[1]) == (1, "see")


def test_every_zero_is_told_since_newer_versions_pass_over_it(tmp_path):
    """Seen in versions after 4.5: `$record->grade && ...` in assign_feedback_offline."""
    site = site_of(ENGLISH)
    data, noted, _ = exported(tmp_path, download(site, ENGLISH), *a_class(0.0))
    assert "a grade of 0, enter it there: " + ", ".join(PEOPLE) in noted
    assert site.upload(data).updated == 23
    assert site_of(ENGLISH, passes_over_zero=True).upload(data).updated == 0


WORKFLOWS = {
    "en": "Marking workflow state",
    "ro": "Starea fluxului de notare",
    "ru": "Этап процесса оценивания",
}


@pytest.mark.parametrize("code", WORKFLOWS)
@pytest.mark.parametrize("kind", ["plain", "workflow", "anonymous"])
def test_what_moodle_keeps_back_from_the_gradebook_is_told(tmp_path, code, kind):
    """Moodle 4.5: mod/assign/gradingtable.php and locallib.php, assign::gradebook_item_update."""
    language = LANGUAGES[code]
    rows = list(csv.reader(io.StringIO(download(site_of(language), language).decode())))
    if kind == "workflow":
        rows = [[*row[:6], "-" if at else WORKFLOWS[code], *row[6:]] for at, row in enumerate(rows)]
    people = {f"s{at}": Person(participant=at) for at in range(1, 24)}
    if kind == "anonymous":
        rows = [[row[0], *row[3:]] for row in rows]
    sheet = csv_text(rows[0], rows[1:]).encode()
    data, noted, _ = exported(tmp_path, sheet, *a_class(), people=people)
    assert site_of(language).upload(data).updated == 23
    assert ("participants are anonymous" in noted) == (kind == "anonymous")
    assert ("has a marking workflow" in noted) == (kind == "workflow")


@pytest.mark.parametrize("language", LANGUAGES.values(), ids=LANGUAGES)
def test_another_maximum_is_refused_in_every_language(tmp_path, language):
    site = site_of(language)
    site.maximum = 100.0
    sheet = download(site, language, maximum="100.00")
    with pytest.raises(CallError, match="the grade's maximum there is 100, the rubric's is 10"):
        exported(tmp_path, sheet, *a_class())
    data, _, _ = exported(tmp_path, sheet, *a_class(), rescale=True)
    assert site.upload(data).grades[1][0] == 72.5


@pytest.mark.parametrize("heading", ["MAXIMUM GRADE", "Maximum Grade", " Maximum grade "])
def test_a_maximum_is_known_without_regard_to_case(tmp_path, heading):
    sheet = download(site_of(ENGLISH), ENGLISH, maximum="100.00")
    with pytest.raises(CallError, match="maximum there is 100"):
        exported(tmp_path, sheet.replace(b"Maximum grade", heading.encode()), *a_class())


def test_identifiers_that_are_bare_numbers_or_of_different_words_are_refused(tmp_path):
    sheet = download(site_of(ENGLISH), ENGLISH)
    with pytest.raises(InputFileError, match="'1' is not 'Participant' and a number"):
        exported(tmp_path, sheet.replace(b"Participant ", b""), *a_class())
    with pytest.raises(InputFileError, match="'-1' is not 'Participant' and a number"):
        exported(tmp_path, sheet.replace(b"Participant ", b"-"), *a_class())
    with pytest.raises(InputFileError, match="different words: 'Participant ', 'Teilnehmer '"):
        exported(tmp_path, sheet.replace(b"Participant 3", b"Teilnehmer 3"), *a_class())


TEAMS = {
    "en": "Group", "ro": "Grup", "ru": "Группы", "de": "Gruppe", "fr": "Groupe", "uk": "Група",
    "tr": "Grup", "el": "Ομάδα", "ar": "المجموعة", "ja": "グループ", "zh_cn": "小组",
}  # fmt: skip


@pytest.mark.parametrize(("code", "team"), [*TEAMS.items(), ("en", "Équipe"), ("ja", "チーム")])
def test_pages_of_groups_are_refused_in_every_language_and_grades_are_not(tmp_path, code, team):
    """Moodle 4.5: feedback/file/importziplib.php, get_participant_mapping: numbers are those of groups."""
    language = LANGUAGES[code]
    sheet = download(site_of(language), language, team=team)
    with pytest.raises(CallError, match=f"(hand in as groups|the worksheet's column) .*'{team}'"):
        exported(tmp_path, sheet, *a_class(), what="feedback")
    data, _, _ = exported(tmp_path, sheet, *a_class())
    assert site_of(language).upload(data).updated == 23


@pytest.mark.parametrize("language", LANGUAGES.values(), ids=LANGUAGES)
def test_a_worksheet_without_groups_is_taken_for_none_of_groups(language):
    sheet = Worksheet.opened(download(site_of(language), language), "w.csv")
    assert sheet.group_columns == []


def test_an_option_says_that_students_hand_in_as_groups_or_that_they_do_not(tmp_path):
    numbers = {"s1": Person(participant=7)}
    with pytest.raises(CallError, match="groups \\(--groups\\)"):
        moodle(tmp_path, "feedback", report("s1", 5.0), name="o.zip", people=numbers, groups=True)
    sheet = download(site_of(ENGLISH), ENGLISH, team="Cohort")
    with pytest.raises(CallError, match="if it is none, give --no-groups"):
        exported(tmp_path, sheet, *a_class(), what="feedback")
    with pytest.raises(InputFileError, match="not all feedback is there"):
        exported(tmp_path, sheet, *a_class(), what="feedback", groups=False)


def test_a_gradebook_item_that_is_new_is_out_of_100_and_takes_no_feedback(tmp_path):
    delivery, path = moodle(tmp_path, "grades", report("s1", 36.567, max_score=43.0), name="o.csv")
    text = path.read_text(encoding="utf-8")
    assert importers.moodle_gradebook(text, {"s1"}) == {"s1": 36.57}
    assert importers.moodle_gradebook(text, {"s1"}, existing=43.0) == {
        "s1": (36.57, "<p>Everything is right.</p>")
    }
    first, second, *_ = notes(delivery)
    assert "grading worksheet is the better way" in first
    assert "make the grade item in Moodle first, out of 43" in second
    assert "a new item is out of 100 and takes no feedback" in second
