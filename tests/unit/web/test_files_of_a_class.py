"""Files that instructors upload: names, kinds, sizes; rosters and assignments with faults."""

import io
import json
import re
import zipfile
from urllib.parse import quote

import pytest
from PIL import Image

from grader.authoring.new import new_assignment
from grader.files import samples_folder
from grader.folder.cache import packed as packed_record
from grader.folder.changes import CACHE_FOLDER
from grader.folder.inventory import FILE_TYPES
from grader.records import Identity, PageRef
from grader.texts.spoken import RefusedError
from grader.web.places import AUTHORED, person_name, safe_name, stored_name
from tests.unit.web.test_budgets import pdf

NAMES = {
    "s01.jpg": "s01.jpg",
    "../../etc/s01.jpg": "etc/s01.jpg",
    "group 3/s01 scan.PDF": "group 3/s01 scan.PDF",
    "C:\\scans\\s01.png": "C:/scans/s01.png",
    "Иванов.jpg": "Иванов.jpg",
    "Петров_1.jpg": "Петров_1.jpg",
    "Сидоров_1.jpg": "Сидоров_1.jpg",
    "S\u0327tefan.jpg": "\u015etefan.jpg",
    "شكل.png": "شكل.png",
    "\U0001f469\u200d\U0001f527.png": "\U0001f469\u200d\U0001f527.png",
    "ж" * 195 + ".jpg": "ж" * 195 + ".jpg",
    "a" * 300 + ".jpg": "a" * 300 + ".jpg",
    "CON.jpg": "CON.jpg",
    "aux.csv": "aux.csv",
    "s01\r\nX: y.jpg": "s01\\r\\nX: y.jpg",
    "s01\u202egpj.pdf": "s01\\u202egpj.pdf",
    "s01\x00.jpg": "s01\\x00.jpg",
}


@pytest.mark.parametrize(("name", "called"), NAMES.items())
def test_a_name_is_kept_for_people_in_any_script(name, called):
    assert person_name(name, FILE_TYPES) == called


def test_a_name_never_reaches_a_path_as_it_is():
    stored = {called: stored_name(called) for called in NAMES.values()}
    assert len(set(stored.values())) == len(NAMES)
    assert stored["s01.jpg"] == "s01.jpg"
    for name in stored.values():
        assert re.fullmatch(r"[A-Za-z0-9_-]+\.(jpg|png|pdf|csv)", name, re.IGNORECASE)
        assert name.partition(".")[0].lower() not in {"con", "aux"}
        assert len(name) <= 120


@pytest.mark.parametrize("name", ["s01.exe", "s01.html", "s01.svg", ".jpg", "..", "", "/", "a.toml"])
def test_other_kinds_of_files_are_refused(name):
    with pytest.raises(RefusedError, match="must end in"):
        person_name(name, FILE_TYPES)


@pytest.mark.parametrize("name", ["._s01.jpg", "~$class.csv", "class/.hidden.pdf", "results.json"])
def test_what_other_programs_leave_behind_is_refused(name):
    with pytest.raises(RefusedError, match="other programs"):
        person_name(name, FILE_TYPES)


def test_files_in_any_script_are_listed_replaced_and_deleted_by_the_names_people_gave(admin, settings):
    key = admin.publish()
    names = ["Петров_1.jpg", "Сидоров_1.jpg", "ж" * 195 + ".jpg", "photos/s01 план.jpg"]
    for name in names:
        sent = admin.act("PUT", f"/publications/{key}/files/{quote(name)}", content=name.encode())
        assert sent.json() == {"name": name, "is_same": False}
    listed = admin.get(f"/api/v1/publications/{key}").json()["files"]
    assert {one["name"] for one in listed} == set(names)
    path = f"/publications/{key}/files/{quote(names[0])}"
    assert admin.act("PUT", path, content=names[0].encode()).json()["is_same"] is True
    refused = admin.act("PUT", path, content=b"other")
    assert (refused.status_code, refused.json()["code"]) == (422, "file_exists")
    assert refused.json()["message"].startswith("Петров_1.jpg: ")
    assert admin.act("DELETE", path).status_code == 200
    listed = admin.get(f"/api/v1/publications/{key}").json()["files"]
    assert {one["name"] for one in listed} == set(names[1:])
    assert all(path.name.isascii() for path in settings.data.rglob("*"))


@pytest.mark.usefixtures("grades_here")
def test_a_class_is_graded_by_the_names_that_people_gave(admin, settings):
    key = admin.publish()
    roster = "student_id,name,n,scans\ns01,Иванов,7,Иванов.jpg\ns02,Петров,7,\n".encode()
    admin.act("PUT", f"/publications/{key}/roster/files/roster.csv", content=roster)
    for name in ("Иванов.jpg", "photos/s02 план.jpg", "кто.jpg"):
        admin.act("PUT", f"/publications/{key}/files/{quote(name)}", content=b"junk")
    job = admin.act("POST", f"/publications/{key}/jobs").json()
    assert admin.ended(f"/publications/{key}/jobs", job)["state"] == "done"
    results = admin.get(f"/api/v1/publications/{key}/results").json()
    files = {one["student_id"]: [told["file"] for told in one["problems"]] for one in results["reports"]}
    assert files["s01"][0] == "Иванов.jpg"
    assert [one["file"] for one in results["unmatched"]] == ["photos/s02 план.jpg", "кто.jpg"]
    assert "file-" not in json.dumps(results)
    assert admin.act("DELETE", f"/publications/{key}/students/s01").status_code == 200
    assert not [path for path in settings.data.rglob("names/*") if "Иванов" in path.read_text("utf-8")]


def test_a_platforms_file_may_have_a_name_in_any_script(admin):
    key = admin.publish()
    answer = admin.act(
        "POST", f"/publications/{key}/exports/moodle/files/{quote('Оценки.csv')}", content=b"a"
    )
    assert "Оценки.csv" in answer.json()["message"] or answer.json()["code"] == "results_missing"
    assert answer.json()["code"] != "file_name"


def test_an_assignments_files_keep_their_double_endings():
    assert safe_name("my own.assignment.toml", AUTHORED) == "my-own.assignment.toml"


def test_a_file_goes_into_the_class_and_nowhere_else(admin, settings):
    key = admin.publish()
    sent = admin.act("PUT", f"/publications/{key}/files/..%2F..%2Fout%2Fs01.jpg", content=b"\xff\xd8\xffabc")
    assert sent.json() == {"name": "out/s01.jpg", "is_same": False}
    top = settings.data / "publications" / key
    assert {path.parent for path in settings.data.rglob("*.jpg")} == {top / "handed-in", top / "names"}


def test_nothing_is_replaced_unless_asked_for(admin, settings):
    key = admin.publish()
    path = f"/publications/{key}/files/s01.jpg"
    admin.act("PUT", path, content=b"one")
    assert admin.act("PUT", path, content=b"one").json()["is_same"] is True
    refused = admin.act("PUT", path, content=b"two")
    assert (refused.status_code, refused.json()["code"]) == (422, "file_exists")
    assert admin.act("PUT", f"{path}?replace=true", content=b"two").status_code == 200
    (stored,) = settings.data.rglob("s01.jpg")
    assert stored.read_bytes() == b"two"


def test_a_body_that_is_too_large_is_refused_and_not_stored(admin, settings):
    key = admin.publish()
    answer = admin.act("PUT", f"/publications/{key}/files/s01.jpg", content=b"x" * 2_000_001)
    assert answer.status_code == 413
    assert not list(settings.data.rglob("s01.jpg"))
    pieces = (b"x" * 100_000 for _ in range(30))
    assert admin.act("PUT", f"/publications/{key}/files/s01.jpg", content=pieces).status_code == 413
    assert admin.act("POST", "/publications", content=b"{" + b" " * 1_000_001).status_code == 413


def test_decisions_and_rosters_are_not_uploaded_as_files(admin):
    key = admin.publish()
    for name in ("decisions.csv", "roster.csv", "Decisions.CSV"):
        assert admin.act("PUT", f"/publications/{key}/files/{name}", content=b"a").status_code == 422


def test_a_roster_with_faults_is_refused_and_the_old_one_stays(admin, settings):
    key = admin.publish()
    path = f"/publications/{key}/roster/files/roster.csv"
    assert admin.act("PUT", path, content=b"student_id,name\ns01,One\n").json() == {"lines": 1}
    answer = admin.act("PUT", path, content=b"student_id,name\n../x,Two\n")
    assert answer.status_code == 422
    assert "line 2" in answer.json()["message"]
    assert str(settings.data) not in answer.text
    (kept,) = settings.data.rglob("roster*.csv")
    assert b"One" in kept.read_bytes()


def test_a_file_is_deleted_by_its_name_alone(admin, settings):
    key = admin.publish()
    admin.act("PUT", f"/publications/{key}/files/s01.jpg", content=b"one")
    admin.act("PUT", f"/publications/{key}/roster/files/roster.csv", content=b"student_id\ns01\n")
    for name in ("..%2F..%2Fsecret", "roster.csv", "nothing.jpg"):
        assert admin.act("DELETE", f"/publications/{key}/files/{name}").status_code in {404, 422}, name
    assert admin.act("DELETE", f"/publications/{key}/files/s01.jpg").status_code == 200
    assert not list(settings.data.rglob("s01.jpg"))


def test_an_own_assignment_is_published_from_its_files(admin, tmp_path):
    new_assignment(tmp_path / "own.toml", mechanism="slider-crank")
    key = admin.publish(assignment=None, is_open=False)
    for path in tmp_path.glob("*.toml"):
        url = f"/publications/{key}/assignment/files/{path.name}"
        assert admin.act("PUT", url, content=path.read_bytes()).status_code == 200
    chosen = {"assignment": "own.toml", "is_open": True}
    answer = admin.act("PATCH", f"/publications/{key}", json=chosen)
    assert answer.status_code == 200, answer.text
    assert admin.get(f"/api/v1/publications/{key}/form").json()["fields"]


def test_an_assignment_with_faults_is_told_and_not_chosen(admin, settings):
    key = admin.publish(assignment=None, is_open=False)
    body = b'title = "x"\nmechanism = "/etc/passwd"\n'
    admin.act("PUT", f"/publications/{key}/assignment/files/bad.assignment.toml", content=body)
    answer = admin.act("PATCH", f"/publications/{key}", json={"assignment": "bad.assignment.toml"})
    assert answer.status_code == 422
    assert "root:" not in answer.text
    assert "bad.assignment.toml" in answer.json()["message"]
    assert str(settings.data) not in answer.text
    assert admin.get(f"/api/v1/publications/{key}").json()["assignment"] == ""
    for name in ("nowhere.assignment.toml", "../../x.assignment.toml", "/etc/passwd"):
        answer = admin.act("PATCH", f"/publications/{key}", json={"assignment": name})
        assert answer.status_code == 422, name


def test_a_publication_and_a_term_are_deleted_with_all_their_files(admin, settings):
    keys = [admin.publish(term="2026 autumn") for _ in range(3)]
    for key in keys:
        admin.act("PUT", f"/publications/{key}/files/s01.jpg", content=b"one")
    assert admin.act("DELETE", f"/publications/{keys[0]}").status_code == 200
    assert len(list(settings.data.rglob("s01.jpg"))) == 2
    assert admin.act("DELETE", "/terms/2026%20autumn").json() == {"removed": 2}
    assert not list(settings.data.rglob("s01.jpg"))
    assert admin.act("DELETE", "/terms/2026%20autumn").status_code == 404


# What arrived, and whose it is --------------------------------------------------------------------

JPEG = (samples_folder() / "pump" / "s01_1.jpg").read_bytes()
ROSTER = (
    "student_id,name,n,scans\ns01,Ștefan Țurcanu,7,\ns02,Ana Pop,8,\ns03,Ion Rusu,9,class.pdf#2\n"
    "s04,Olga Lungu,10,\n"
)


def packed(**files):
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as made:
        for name, content in files.items():
            made.writestr(name, content)
    return archive.getvalue()


def listed(admin, key):
    known = admin.get(f"/api/v1/publications/{key}").json()
    missing = [one["student_id"] for one in known["missing"]]
    return {one["name"]: one["students"] for one in known["files"]}, missing


@pytest.mark.usefixtures("grades_here")
def test_a_zip_is_taken_file_by_file_and_each_has_its_student(admin, settings):
    key = admin.publish()
    admin.act("PUT", f"/publications/{key}/roster/files/roster.csv", content=ROSTER.encode())
    moodle = "Stefan Turcanu_101_assignsubmission_file_/plan.jpg"
    files = dict.fromkeys([moodle, "s02_1.jpg", "x/what.jpg", "../../out.jpg"], JPEG)
    files |= {"a.exe": b"", "roster.csv": b""}
    sent = admin.act("PUT", f"/publications/{key}/files/all.zip", content=packed(**files)).json()
    assert [one["name"] for one in sent["files"]] == [moodle, "s02_1.jpg", "x/what.jpg"]
    assert {one["name"] for one in sent["refused"]} == {"../../out.jpg", "a.exe", "roster.csv"}
    assert listed(admin, key) == ({moodle: ["s01"], "s02_1.jpg": ["s02"], "x/what.jpg": []}, ["s03", "s04"])
    assert {path.suffix for path in settings.data.rglob("*.*")}.isdisjoint({".zip", ".exe"})
    changed = packed(**files | {moodle: JPEG + b"more"})
    again = admin.act("PUT", f"/publications/{key}/files/all.zip", content=changed).json()
    assert [one["is_same"] for one in again["files"]] == [True, True]
    assert "plan.jpg" in str(again["refused"])
    newer = packed(**{moodle: JPEG + b"more"})
    sent = admin.act("PUT", f"/publications/{key}/files/all.zip?replace=true", content=newer).json()
    assert (sent["files"], sent["refused"]) == ([{"name": moodle, "is_same": False}], [])
    assert admin.act("DELETE", f"/publications/{key}/students/s01").status_code == 200
    assert moodle not in listed(admin, key)[0]


@pytest.mark.usefixtures("grades_here")
def test_a_class_file_is_of_those_of_its_pages_and_a_table_of_those_in_it(admin):
    key = admin.publish()
    admin.act("PUT", f"/publications/{key}/roster/files/roster.csv", content=ROSTER.encode())
    admin.act("PUT", f"/publications/{key}/files/class.pdf", content=pdf(3))
    table = b"student_id,v_A\ns01,60\nstranger,60\ns02,60\n"
    admin.act("PUT", f"/publications/{key}/files/measured.csv", content=table)
    assert listed(admin, key) == ({"class.pdf": ["s03"], "measured.csv": ["s01", "s02"]}, ["s04"])


@pytest.mark.usefixtures("grades_here")
def test_a_page_that_was_graded_is_of_the_student_of_its_code(admin, settings):
    key = admin.publish()
    admin.act("PUT", f"/publications/{key}/roster/files/roster.csv", content=ROSTER.encode())
    admin.act("PUT", f"/publications/{key}/files/scan7.jpg", content=JPEG)
    page = PageRef("scan7.jpg", identity=Identity("pump", "s04", 10, None, "all"))
    note = json.dumps(("", {"scan7.jpg": ((0, 0, 0, 0), packed_record([page], []))}))
    where = settings.data / "publications" / key / "results" / CACHE_FOLDER
    where.mkdir(parents=True)
    (where / "files.json").write_text(note, encoding="utf-8")
    assert listed(admin, key)[0] == {"scan7.jpg": ["s04"]}


@pytest.mark.usefixtures("grades_here")
def test_a_file_has_a_small_picture_for_its_instructors_alone(admin, visitor):
    key = admin.publish()
    admin.act("PUT", f"/publications/{key}/files/s01.jpg", content=JPEG)
    admin.act("PUT", f"/publications/{key}/files/s02.jpg", content=b"junk")
    path = f"/api/v1/publications/{key}/thumbnails"
    small = admin.get(f"{path}/s01.jpg")
    assert (small.status_code, small.headers["content-type"]) == (200, "image/jpeg")
    assert max(Image.open(io.BytesIO(small.content)).size) < 1000
    assert admin.get(f"{path}/s01.jpg").content == small.content
    assert admin.get(f"{path}/s02.jpg").status_code in {400, 422}
    assert admin.get(f"{path}/nothing.jpg").status_code == 404
    assert visitor.get(f"{path}/s01.jpg").status_code in {401, 404}
