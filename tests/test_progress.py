import time

from dnf_pyg.progress import Stopwatch, progress_bar


def test_bar_shows_what_is_done_unless_hidden(capsys):
    for hidden in (False, True, None):  # captured output is no terminal
        with progress_bar("filtering", "face", hidden=hidden) as report:
            report(3, 8)
            report(8, 8)
        assert ("filtering" in capsys.readouterr().err) == (hidden is False)


def test_stopwatch_adds_the_laps_of_a_stage(monkeypatch):
    clock = iter([0.0, 1.0, 3.0, 7.0])
    monkeypatch.setattr(time, "perf_counter", lambda: next(clock))
    watch = Stopwatch()
    for stage in ("a", "b", "a"):
        watch.lap(stage)
    assert watch.seconds == {"a": 5.0, "b": 2.0}
