"""The house rules: who may import whom, types, style. Each tool's own report is the failure message."""

import ast
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


CORE = [
    path for folder in ("control", "flight", "protocol", "tlog") for path in (ROOT / "mavquad" / folder).rglob("*.py")
]
MODULES = ("agent", "agent_params", "captain", "crew", "endpoint", "flight_record", "frames", "schema", "types", "url")
CORE += [ROOT / "mavquad" / f"{name}.py" for name in MODULES if (ROOT / "mavquad" / f"{name}.py").exists()]
LIVE = ("__main__.py", "clock.py", "command.py", "live.py", "server.py", "sockets.py", "transports.py")
CORE += [path for path in (ROOT / "sitl_mock").rglob("*.py") if path.name not in LIVE]


@pytest.mark.parametrize("path", CORE, ids=lambda path: str(path.relative_to(ROOT)))
def test_core_reads_no_clock_and_opens_nothing(path: Path) -> None:
    text = path.read_text()
    for module in ("time", "asyncio", "socket", "threading", "logging", "subprocess", "secrets"):
        assert f"\nimport {module}\n" not in text
        assert f"\nfrom {module} import" not in text


GENERATORS = ("random.Random", "numpy.random.default_rng")


def unseeded(text: str) -> list[str]:
    """Uses of `random` and `numpy.random` in a module's source, other than making a generator from a seed or naming
    its type.
    """
    tree = ast.parse(text)
    imported: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [(name.asname, name.name) if name.asname else (name.name.split(".")[0],) * 2 for name in node.names]
            imported.update(names)
        elif isinstance(node, ast.ImportFrom):
            imported.update({name.asname or name.name: f"{node.module}.{name.name}" for name in node.names})

    def dotted(node: ast.AST) -> str:
        if isinstance(node, ast.Attribute):
            return f"{dotted(node.value)}.{node.attr}"
        return imported.get(node.id, "") if isinstance(node, ast.Name) else ""

    seeded = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and dotted(node.func) in GENERATORS:
            given = [*node.args, *(keyword.value for keyword in node.keywords)]
            if given and not (isinstance(given[0], ast.Constant) and given[0].value is None):
                seeded.add(node.func)
    for node in ast.walk(tree):
        for types in (getattr(node, "annotation", None), getattr(node, "returns", None)):
            seeded.update(ast.walk(types) if types else ())
    used = [(node, dotted(node)) for node in ast.walk(tree) if isinstance(node, ast.Attribute | ast.Name)]
    return [name for node, name in used if node not in seeded and name.startswith(("random.", "numpy.random."))]


@pytest.mark.parametrize("path", CORE, ids=lambda path: str(path.relative_to(ROOT)))
def test_random_numbers_have_a_seed(path: Path) -> None:
    assert unseeded(path.read_text()) == []


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import random\nx = random.gauss(0, 1)", "random.gauss"),
        ("import random\nrandom.shuffle(x)", "random.shuffle"),
        ("import random as r\nx = [r.uniform(0, 1) for _ in y]", "random.uniform"),
        ("import random\ndraw = random.random", "random.random"),
        ("import random\nx = random.Random()", "random.Random"),
        ("import random\nx = random.Random(None)", "random.Random"),
        ("import random\nx = random.SystemRandom(1)", "random.SystemRandom"),
        ("from random import randint\nx = randint(1, 6)", "random.randint"),
        ("import numpy as np\nx = np.random.normal(0, 1)", "numpy.random.normal"),
        ("import numpy\nx = numpy.random.default_rng()", "numpy.random.default_rng"),
        ("from numpy import random\nx = random.choice(y)", "numpy.random.choice"),
        ("from numpy.random import default_rng\nx = default_rng()", "numpy.random.default_rng"),
    ],
)
def test_what_counts_as_without_a_seed(text: str, found: str) -> None:
    assert found in unseeded(text)


@pytest.mark.parametrize(
    "text",
    [
        "import random\nx = random.Random(seed)\ny = x.random()",
        "import random\nx = random.Random(x=1)",
        "from random import Random\nx = Random(1).gauss(0, 1)",
        "import numpy as np\nx = np.random.default_rng(7).normal()",
        "x = self._random.random()",
        "import random\ndef draw(source: random.Random) -> random.Random: ...",
        "import numpy as np\nx: np.random.Generator",
    ],
)
def test_what_has_a_seed(text: str) -> None:
    assert unseeded(text) == []
