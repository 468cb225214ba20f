"""pytest: the fixture `mock_vehicle`, a vehicle of the mock for a test.

    @pytest.mark.mock_vehicle(autopilot="ardupilot", wind=(5, 0, 0), faults=[{"kind": "silent", "from_s": 60, "for_s": 2}])
    def test_mission(mock_vehicle):
        connection = mock_vehicle.connect()

The marker takes the arguments of `sitl_mock.VirtualVehicle`, or with `live=True` those of `sitl_mock.LiveVehicle`. The
nearest marker wins key by key, so a class or a module can set what its tests share. `indirect` parametrisation lays a
table over the markers. `mock_vehicles` makes several: `mock_vehicles(autopilot="px4", seed=2)`.

Where a test fails, its report has a section with the story of each vehicle. The mock is imported when a test first asks
for a vehicle, so that having it installed costs other test runs nothing.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator, Iterator
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sitl_mock import LiveVehicle, VirtualVehicle

    Vehicle = VirtualVehicle | LiveVehicle

_MARKER = "mock_vehicle"
_VEHICLES = pytest.StashKey[list[Any]]()


def pytest_configure(config: pytest.Config) -> None:
    """Make the marker known."""
    config.addinivalue_line(
        "markers",
        f"{_MARKER}(live=False, **arguments): the vehicle that the fixture mock_vehicle makes: arguments of "
        "sitl_mock.VirtualVehicle, or of sitl_mock.LiveVehicle",
    )


@pytest.fixture
def mock_vehicles(request: pytest.FixtureRequest) -> Iterator[Callable[..., Vehicle]]:
    """Makes mock vehicles: `mock_vehicles(autopilot="px4", live=True)`; they are switched off after the test."""
    with contextlib.ExitStack() as running:

        def make(*, live: bool = False, **arguments: Any) -> Vehicle:
            vehicle = _vehicle(live, arguments, running)
            request.node.stash.setdefault(_VEHICLES, []).append(vehicle)
            return vehicle

        yield make


@pytest.fixture
def mock_vehicle(request: pytest.FixtureRequest, mock_vehicles: Callable[..., Vehicle]) -> Vehicle:
    """A mock vehicle as the test's markers `mock_vehicle` say, and its parameter if it is parametrised."""
    arguments: dict[str, Any] = {}
    for marker in reversed(list(request.node.iter_markers(_MARKER))):
        if marker.args:
            pytest.fail(f"the marker {_MARKER} takes keywords only, e.g. autopilot='px4'", pytrace=False)
        arguments |= marker.kwargs
    given = getattr(request, "param", {})
    if not isinstance(given, dict):
        pytest.fail(f"mock_vehicle: a parameter is a dict of its arguments, not {given!r}", pytrace=False)
    return mock_vehicles(**arguments | given)


def _vehicle(live: bool, arguments: dict[str, Any], running: contextlib.ExitStack) -> Vehicle:
    from mavquad.errors import InputError
    from sitl_mock import LiveVehicle, VirtualVehicle

    try:
        return running.enter_context(LiveVehicle(**arguments)) if live else VirtualVehicle(**arguments)
    except InputError as error:
        pytest.fail(f"{error.message} {error.hint}".rstrip(), pytrace=False)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Put the story of its vehicles into the report of a test that failed."""
    report = yield
    if report.failed:
        vehicles: list[Any] = item.stash.get(_VEHICLES, [])
        for number, vehicle in enumerate(vehicles, 1):
            title = f"mock vehicle {number} ({vehicle.config.autopilot} {vehicle.config.firmware})"
            report.sections.append((title, _story(vehicle)))
    return report


def _story(vehicle: Vehicle) -> str:
    try:
        return vehicle.report()
    except Exception as error:  # noqa: BLE001 - a vehicle without a story must not hide why the test failed
        return f"no story: {error}"
