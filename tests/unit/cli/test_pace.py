from grader.cli import terminal


def test_the_pace_counts_what_is_done_now_and_tells_the_time_left(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(terminal.time, "monotonic", lambda: now[0])
    pace = terminal.Pace()
    assert not pace("marking", 1000, 3000)
    now[0] += 0.5
    assert not pace("marking", 1010, 3000)
    now[0] += 59.5
    assert pace("marking", 1020, 3000) == "20 a minute, 1 h 39 min left"
    now[0] += 60.0
    assert pace("marking", 2990, 3000) == "995 a minute, 1 s left"
    assert not pace("marking", 3000, 3000)
