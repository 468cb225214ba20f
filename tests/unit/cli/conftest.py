"""The command line from the outside."""

import pytest

from mavquad.cli import main


@pytest.fixture
def columns() -> str:
    """Width of the terminal."""
    return "80"


@pytest.fixture
def cli(monkeypatch, capsys, tmp_path, columns):
    """Runs `mavquad ARGUMENTS` in an empty folder; returns (exit code, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", columns)

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["mavquad", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return ended.value.code, out, err

    return run
