"""``planmark demo``: one page that leads everywhere, and reports that do not contradict themselves."""

import re

import pytest

from grader.documents import ResultsDocument
from tests.bench.contradictions import contradictions

pytestmark = pytest.mark.slow


def test_the_demos_page_leads_to_every_student_and_no_report_contradicts_itself(planmark, tmp_path):
    ran = planmark("demo", "--jobs", 2)
    assert ran.returncode == 0, ran.stderr
    out = tmp_path / "planmark-demo"
    assert "planmark-demo/index.html" in ran.stdout.replace("\\", "/")
    classes = re.findall(r'href="([^"]+)"', (out / "index.html").read_text(encoding="utf-8"))
    assert classes == ["pump/index.html", "press/index.html"]
    for page in classes:
        text = (out / page).read_text(encoding="utf-8")
        name = page.partition("/")[0]
        assert f"planmark export planmark-demo/{name}" in text
        students = set(re.findall(r'href="([^"#]+)"', text))
        assert len(students) >= 5
        assert all((out / page).parent.joinpath(student).is_file() for student in students)
        results = ResultsDocument.model_validate_json((out / page).with_name("results.json").read_bytes())
        found = [
            f"{report.student_id} {what}" for report in results.reports for what in contradictions(report)
        ]
        assert found == []
