"""The house rules: who may import whom, types, style. Each tool's own report is the failure message."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

TOOLS = {
    "imports": ["lint-imports", "--no-cache"],
    "style": ["ruff", "check", "--no-cache", "."],
    "format": ["ruff", "format", "--no-cache", "--check", "."],
    "types": ["mypy", "--no-incremental"],
}


@pytest.mark.parametrize("name", TOOLS)
def test_tool_finds_nothing(name: str) -> None:
    tool, *arguments = TOOLS[name]
    beside_python = Path(sys.executable).parent / tool
    result = subprocess.run([str(beside_python), *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr


CORE = [path for folder in ("control", "flight", "protocol") for path in (ROOT / "mavquad" / folder).rglob("*.py")]
CORE += [ROOT / "mavquad" / name for name in ("agent.py", "endpoint.py", "frames.py", "types.py")]
CORE += [path for path in (ROOT / "sitl_mock").rglob("*.py") if path.name not in ("cli.py", "__main__.py")]


@pytest.mark.parametrize("path", CORE, ids=lambda path: str(path.relative_to(ROOT)))
def test_core_reads_no_clock_and_opens_nothing(path: Path) -> None:
    text = path.read_text()
    for module in ("time", "asyncio", "socket", "threading", "logging", "subprocess", "secrets"):
        assert f"\nimport {module}\n" not in text
        assert f"\nfrom {module} import" not in text


@pytest.mark.parametrize("path", CORE, ids=lambda path: str(path.relative_to(ROOT)))
def test_random_numbers_have_a_seed(path: Path) -> None:
    text = path.read_text()
    assert "random.random()" not in text.replace("self._random.random()", "")
    assert "Random()" not in text
    assert "default_rng()" not in text
