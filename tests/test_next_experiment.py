"""The recording that is asked for: a signal that can be written and played."""

import shlex

import numpy as np
from typer.testing import CliRunner

from drill_env.cli.main import app
from drill_env.diagnosis import next_experiment as asked
from drill_env.recordings.signals import parse_signal, signal_samples


def test_every_signal_of_the_menu_is_another_one_and_has_other_words():
    menu = asked._menu()
    played = [signal_samples(signal)[1] for signal in menu]
    for i, one in enumerate(played):
        assert np.abs(one).max() <= 5.0
        assert all(np.abs(one - other).max() > 0.1 for other in played[:i])
    assert len({asked._words(signal) for signal in menu}) == len(menu)


def test_the_command_writes_the_very_voltage_that_was_weighed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for signal in asked._menu():
        program, *words = shlex.split(asked._command(signal))
        assert program == "drill-env"
        told = CliRunner().invoke(app, words)
        assert told.exit_code == 0, told.output
        written = np.loadtxt(tmp_path / "play.csv", delimiter=",", skiprows=1)
        t, u = signal_samples(signal)
        assert len(t) == 12000
        np.testing.assert_allclose(written[:, 0], t, atol=1e-6)
        np.testing.assert_allclose(written[:, 1], u, atol=1e-6)
        assert parse_signal(signal.text) == signal
        (tmp_path / "play.csv").unlink()
