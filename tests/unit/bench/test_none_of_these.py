"""The benchmark of random sheets, slips of units and confidence runs, and counts what it says."""

import pytest

from tests.bench import none_of_these


@pytest.mark.slow
def test_each_table_has_its_rows(monkeypatch):
    monkeypatch.setattr(none_of_these, "ASSIGNMENTS", ("press",))
    monkeypatch.setattr(none_of_these, "HANDS", ("careful",))
    sheets, slips, confidence = none_of_these.tables(1, 1, 1)
    assert len(sheets[2]) == 4
    assert {row[0] for row in slips[2]} >= {"radians", "cm", "values in cm/s"}
    assert confidence[2]
