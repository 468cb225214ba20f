"""The exception tree: codes, messages, and the data that they carry."""

from __future__ import annotations

import pytest

from mavquad import errors

CODES = {
    "MavquadError": 70,
    "InputError": 2,
    "ConfigError": 2,
    "EndpointError": 2,
    "LogError": 2,
    "RunFolderError": 2,
    "VehicleError": 3,
    "VehicleRefused": 3,
    "VehicleTimeout": 3,
    "FlightEnded": 4,
    "ReplayDiffers": 5,
    "Abandoned": 4,
    "InternalError": 70,
}


@pytest.mark.parametrize(("name", "code"), CODES.items())
def test_exit_codes(name, code):
    assert getattr(errors, name).exit_code == code


def test_every_error_is_in_the_tree_and_in_its_picture():
    ours = {name for name, value in vars(errors).items() if isinstance(value, type)}
    assert ours == set(CODES)
    assert all(issubclass(getattr(errors, name), errors.MavquadError) for name in ours)
    assert all(name in errors.__doc__ for name in ours)


def test_the_other_codes():
    assert (errors.EXIT_OK, errors.EXIT_INTERNAL, errors.EXIT_INTERRUPTED) == (0, 70, 130)


def test_message_and_hint():
    error = errors.FlightEnded("what", "do this")
    assert (str(error), error.message, error.hint) == ("what", "what", "do this")
    assert errors.FlightEnded("what").hint == ""


def test_a_configuration_error_names_file_and_key():
    error = errors.ConfigError("a.toml", "law.omega0_rad_s", "too large", "smaller")
    assert error.message == "a.toml: law.omega0_rad_s: too large"
    assert (error.path, error.key, error.reason, error.hint) == ("a.toml", "law.omega0_rad_s", "too large", "smaller")
    assert errors.ConfigError("a.toml", "", "no such file").message == "a.toml: no such file"


@pytest.mark.parametrize("name", ["EndpointError", "LogError", "RunFolderError"])
def test_what_and_why(name):
    assert getattr(errors, name)("it", "is wrong").message == "it: is wrong"


def test_a_refusal_cites_the_vehicle():
    error = errors.VehicleRefused("arm", "DENIED", "Preflight Fail", "look")
    assert error.message == 'the vehicle refused: arm (DENIED); the vehicle says: "Preflight Fail"'
    assert (error.request, error.result, error.statustext, error.hint) == ("arm", "DENIED", "Preflight Fail", "look")
    assert errors.VehicleRefused("arm", "DENIED").message == "the vehicle refused: arm (DENIED)"


def test_a_timeout_says_how_long_and_how_often():
    assert errors.VehicleTimeout("land", 20, 6.04).message == "no answer: land (waited 6.0 s, 20 tries)"
    assert errors.VehicleTimeout("land", 1, 6.0).message == "no answer: land (waited 6.0 s)"
    assert errors.VehicleTimeout("land", 1, 6.0, "hm").message.endswith('; the vehicle says: "hm"')


def test_what_happens_later_is_told_too_and_the_first_cause_keeps_its_code():
    error = errors.VehicleRefused("mode OFFBOARD", "DENIED", hint="first")
    error.followed_by(errors.FlightEnded("lost in flight", "check the link"))
    assert error.message == str(error) == "the vehicle refused: mode OFFBOARD (DENIED); then lost in flight"
    assert error.hint == "check the link"
    assert error.exit_code == 3


def test_what_is_said_already_is_not_said_again():
    error = errors.FlightEnded("lost")
    for _ in range(100):
        error.followed_by(errors.VehicleRefused("land", "DENIED", hint="watch it"))
    assert error.message == "lost; then the vehicle refused: land (DENIED)"
    assert error.hint == "watch it"
