"""The pytest plugin, run by pytest itself: fixture, marker, parameters, reports; and what it costs those who do not use it."""

import subprocess
import sys

import pytest

# Imported here, or each inner run would import them anew.
import sitl_mock.api.connection
import sitl_mock.api.live
import sitl_mock.api.virtual  # noqa: F401

pytest_plugins = ["pytester"]


@pytest.fixture
def run(pytester):
    def ran(body, *options):
        pytester.makepyfile("import pytest\n" + body)
        return pytester.runpytest_inprocess("-p", "sitl_mock.pytest_plugin", "-p", "no:cacheprovider", *options)

    return ran


def test_the_marker_configures_the_vehicle_key_by_key(run):
    result = run("""
pytestmark = pytest.mark.mock_vehicle(autopilot="ardupilot", wind=(1, 2, 3))

def test_module(mock_vehicle):
    assert mock_vehicle.config.autopilot == "ardupilot"
    assert mock_vehicle.config.wind_ned_m_s == (1, 2, 3)

@pytest.mark.mock_vehicle(autopilot="px4", firmware="1.16")
def test_own(mock_vehicle):
    assert mock_vehicle.config.firmware == "1.16"
    assert mock_vehicle.config.wind_ned_m_s == (1, 2, 3)

@pytest.mark.parametrize("mock_vehicle", [{"autopilot": "px4"}], indirect=True)
def test_parameter(mock_vehicle):
    assert mock_vehicle.config.autopilot == "px4"
""")
    result.assert_outcomes(passed=3)


def test_without_a_marker_it_is_a_px4_in_virtual_time(run):
    run("""
def test_it(mock_vehicle):
    mock_vehicle.run(1.0)
    assert mock_vehicle.now_s == 1.0
    assert mock_vehicle.config.autopilot == "px4"
""").assert_outcomes(passed=1)


def test_several_and_live(run):
    run("""
def test_it(mock_vehicles):
    one, two = mock_vehicles(), mock_vehicles(live=True, system_id=7)
    one.run(1.0)
    assert two.url.startswith("tcp:")
    test_it.vehicle = two

def test_it_is_gone():
    assert not test_it.vehicle._thread.is_alive()
""").assert_outcomes(passed=2)


def test_a_failure_shows_the_story(run):
    result = run("""
def test_it(mock_vehicles):
    one, two = mock_vehicles(), mock_vehicles(autopilot="ardupilot", firmware="4.7")
    connection = one.connect()
    connection.wait_heartbeat()
    one.run(2.0)
    connection.arducopter_arm()
    one.run(0.1)
    two.run(1.0)
    assert one.truth.landed and one.truth.crashed
""")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [
            "*mock vehicle 1 (px4 auto)*",
            "*0.004 s  mode AUTO.LOITER",
            "*2.004 s  armed",
            "*2.104 s  last state: AUTO.LOITER, armed, on the ground",
            "*mock vehicle 2 (ardupilot 4.7)*",
            "*1.000 s  last state: STABILIZE, disarmed, on the ground",
        ]
    )


def test_a_test_that_passes_says_nothing(run):
    assert "last state" not in run("def test_it(mock_vehicle): mock_vehicle.run(1.0)", "-rA").stdout.str()


@pytest.mark.parametrize(
    ("marker", "words"),
    [
        ("faults=[{'kind': 'silnt'}]", "mock vehicle: fault 1: unknown kind 'silnt'; did you mean silent?*"),
        ("firmwear='1.16'", "mock vehicle: firmwear: unknown key; did you mean firmware?*"),
        ("'ardupilot'", "the marker mock_vehicle takes keywords only*"),
        ("live=True, endpoints=['udp:1']", "udp:1: not an endpoint of the mock*"),
    ],
)
def test_a_mistake_in_a_marker_is_named_without_a_traceback(run, marker, words):
    result = run(f"@pytest.mark.mock_vehicle({marker})\ndef test_it(mock_vehicle): pass", "--strict-markers")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines([words])
    assert "schema.py" not in result.stdout.str()


def test_who_does_not_use_it_does_not_import_the_mock():
    code = (
        "import sys, sitl_mock.pytest_plugin; print([m for m in sys.modules if m.startswith(('sitl_mock.', 'pymav'))])"
    )
    output = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert output.strip() == "['sitl_mock.pytest_plugin']"
