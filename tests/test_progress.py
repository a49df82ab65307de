import time

from dnf_pyg.progress import Stopwatch, progress_bar


def test_bar_shows_what_is_done_unless_hidden(capsys):
    for hidden in (False, True, None):  # captured output is no terminal
        with progress_bar("filtering", "face", hidden=hidden) as report:
            report(3, 8)
            report(8, 8)
        assert ("filtering" in capsys.readouterr().err) == (hidden is False)


def test_lines_every_ten_seconds_where_there_is_no_terminal(capsys, monkeypatch):
    now = 0.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    with progress_bar("filtering a.ply", "face") as report:
        for now in (1.0, 11.0, 12.0, 25.0):
            report(int(now), 50)
    assert capsys.readouterr().err == "filtering a.ply: 11 of 50 faces, 22%\nfiltering a.ply: 25 of 50 faces, 50%\n"


def test_stopwatch_adds_the_laps_of_a_stage(monkeypatch):
    clock = iter([0.0, 1.0, 3.0, 7.0])
    monkeypatch.setattr(time, "perf_counter", lambda: next(clock))
    watch = Stopwatch()
    for stage in ("a", "b", "a"):
        watch.lap(stage)
    assert watch.seconds == {"a": 5.0, "b": 2.0}
