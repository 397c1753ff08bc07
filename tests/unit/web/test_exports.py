"""Files for platforms, as an instructor gets them from the page of a class."""

import os

import pytest

from grader.lms.grades import Person
from grader.rubric import load_rubric
from tests.unit.lms.test_moodle_imports import HELD, LANGUAGES, download, site_of


@pytest.mark.parametrize("code", ["ro", "ru"])
def test_a_colleagues_grade_stays_where_the_worksheet_went_through_the_web(graded, admin, code):
    key, _ = graded
    reports, language = admin.get(f"/api/v1/publications/{key}/results").json()["reports"], LANGUAGES[code]
    assert [one["status"] for one in reports] == ["graded", "graded"]
    site = site_of(language, grades=dict.fromkeys((1, 2), (1.0, HELD)))
    site.maximum = reports[0]["max_score"]
    people = {f"s{at}": Person(name=f"Student {at}", email="-") for at in (9, 11)}
    sheet = download(site, language, maximum=f"{site.maximum:.2f}", people=people)
    site.grades[2] = given = (2.0, HELD + 7200.0)
    answer = admin.act("POST", f"/publications/{key}/exports/moodle/files/Оценки.csv", content=sheet)
    assert site.upload(answer.content).updated == 1
    assert site.grades[1][0] == pytest.approx(reports[0]["score"], abs=0.005)
    assert site.grades[2] == given


SHEET = (
    "Identifier,Full name,Email address,Grade,Maximum grade,Marking workflow state,Grade can be changed,"
    f"Last modified (grade)\r\nParticipant 9,Student 9,-,,{load_rubric('pump').max_score:.2f},-,Yes,-\r\n"
)
REPORT = {
    "en": ("nobody in the platform's file has", "Moodle reports must be 1"),
    "ro": ("nimeni din fișierul platformei nu are", "numărul de note actualizate"),
    "ru": ("в файле платформы ни у кого нет", "обновлено оценок: 1"),
}


def told_of(admin, key, platform, files=(), lang="en", **chosen):
    sent = {name: (f"{name}.csv", text.encode()) for name, text in dict(files).items()}
    answer = admin.act(
        "POST", f"/publications/{key}/exports/{platform}", params=chosen, files=sent or None,
        headers={"Accept-Language": lang},
    )  # fmt: skip
    assert answer.status_code == 201, answer.text
    return answer.json()


@pytest.mark.parametrize("lang", REPORT)
def test_an_export_tells_in_the_pages_language_who_is_left_out_and_what_to_compare(graded, admin, lang):
    key, _ = graded
    roster = "student_id,name,n\ns09,Student 9,27\ns11,Student 11,5\ns12,Student 12,6\n"
    admin.act("PUT", f"/publications/{key}/roster/files/roster.csv", content=roster.encode())
    told = told_of(admin, key, "moodle", {"form": SHEET}, lang)
    assert told["written"] == ["s09"]
    (reason,) = told["unplaced"]["s11"]
    codes = [note["code"] for note in told["notes"]]
    assert (reason["code"], codes[:3]) == ("row_absent", ["workflow", "no_comments", "updates"])
    assert REPORT[lang][0] in reason["message"]
    assert REPORT[lang][1] in told["notes"][2]["message"]
    assert told["notes"][2]["parameters"] == {"count": 1}
    file = admin.get(told["address"])
    assert file.headers["content-disposition"] == 'attachment; filename="export-moodle.csv"'
    assert file.text.count("\n") == 2


def test_ids_criteria_and_groups_are_given_as_on_the_command_line(graded, admin, settings):
    key, _ = graded
    ids = {"ids": "student_id,id,participant\ns09,4711,9\n"}
    told = told_of(admin, key, "lti", ids)
    assert (told["written"], list(told["unplaced"])) == (["s09"], ["s11"])
    told = told_of(admin, key, "moodle", ids, what="feedback", groups=False)
    assert [note["code"] for note in told["notes"]] == ["archive_size", "grades_first"]
    assert "not_for_groups" in str(told_of(admin, key, "moodle", ids, what="feedback")["notes"])
    path = f"/publications/{key}/exports/moodle"
    refused = admin.act("POST", f"{path}?what=feedback&groups=true")
    assert (refused.status_code, refused.json()["code"]) == (422, "groups")
    wrong = {"criteria": ("of Moodle.csv", b"criterion,id\nv_A,x\n")}
    refused = admin.act("POST", f"{path}?what=marks&assignment_id=7", files=wrong)
    assert (refused.status_code, refused.json()["code"]) == (422, "criteria")
    assert refused.json()["message"].startswith("criteria.csv: these are not the rubric's criteria")
    assert list(settings.data.rglob("criteria.csv")) == []
    for field, table, why in (("ids", b"student_id,id\ns09\n", "ids.csv: rândul 2"), ("idz", b"", "„idz”")):
        sent = {field: ("any.csv", table)}
        refused = admin.act("POST", path, files=sent, headers={"Accept-Language": "ro"})
        assert why in refused.json()["message"], field


def test_files_for_platforms_stay_for_an_hour_and_go_with_a_student(graded, admin, settings):
    key, _ = graded
    first, second = (told_of(admin, key, "canvas")["address"] for _ in range(2))
    folder = settings.data / "publications" / key / "exports"
    old = folder / first.rpartition("/")[2]
    os.utime(old, (0, 0))
    told_of(admin, key, "canvas")
    assert admin.get(first).status_code == 404
    assert "s09" in admin.get(second).text
    assert admin.act("DELETE", f"/publications/{key}/students/s09").status_code == 200
    assert (admin.get(second).status_code, folder.exists()) == (404, False)


def test_an_export_is_its_members_own(graded, admin, colleague, student):
    key, _ = graded
    address = told_of(admin, key, "csv")["address"]
    for browser, status in ((colleague, 404), (student, 401)):
        assert browser.get(address).status_code == status
        assert browser.act("POST", f"/publications/{key}/exports/csv").status_code == status
