"""The benchmark of random sheets and confidence runs, and counts what it says."""

import pytest

from tests.bench import none_of_these


@pytest.mark.slow
def test_each_table_has_its_rows(monkeypatch):
    monkeypatch.setattr(none_of_these, "ASSIGNMENTS", ("press",))
    monkeypatch.setattr(none_of_these, "HANDS", ("careful",))
    sheets, confidence = none_of_these.tables(1, 1, 1)
    assert len(sheets[2]) == 4
    assert confidence[2]
