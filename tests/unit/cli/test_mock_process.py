"""The bundled mock as a child process."""

from mavquad.cli.mock_process import start_mock
from mavquad.config import default_path, load


def test_files_of_the_users_folder_are_no_modules_of_the_mock(tmp_path, monkeypatch):
    (tmp_path / "random.py").write_text("raise ZeroDivisionError")
    monkeypatch.chdir(tmp_path)
    with start_mock(load(default_path())) as url:
        assert url.startswith("udpout:127.0.0.1:")
