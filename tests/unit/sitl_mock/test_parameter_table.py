"""The tables of parameters."""

import struct
from typing import get_args

import pytest

from mavquad.protocol.codec import mavlink
from sitl_mock.config import MockConfig, Px4Release
from sitl_mock.personality.parameter_table import load_parameters
from sitl_mock.personality.px4.defaults import px4_parameters

PX4 = "sitl_mock.personality.px4"


@pytest.mark.parametrize(
    ("release", "count"), [("1.13", 722), ("1.14", 861), ("1.15", 882), ("1.16", 893), ("1.17", 872)]
)
def test_every_recorded_parameter_in_order(release, count):
    rows = load_parameters(PX4, f"parameters_{release}.csv")
    names = [row.name for row in rows]
    assert len(names) == count
    assert names == sorted(names)
    assert len(set(names)) == count
    assert max(len(name) for name in names) <= 16


@pytest.mark.parametrize("release", get_args(Px4Release))
def test_values_are_of_their_type(release):
    for row in load_parameters(PX4, f"parameters_{release}.csv"):
        if row.wire_type == mavlink.MAV_PARAM_TYPE_INT32:
            assert isinstance(row.value, int)
            struct.pack("<i", row.value)
        else:
            assert row.wire_type == mavlink.MAV_PARAM_TYPE_REAL32
            assert isinstance(row.value, float)


def test_known_values():
    old = {row.name: row.value for row in load_parameters(PX4, "parameters_1.13.csv")}
    new = {row.name: row.value for row in load_parameters(PX4, "parameters_1.16.csv")}
    assert (old["MPC_THR_MIN"], old["COM_OBL_ACT"], old["SIH_LOC_LAT0"]) == (0.12, 0, 454671160)
    assert (new["MPC_THR_MIN"], new["COM_FAIL_ACT_T"], new["SIH_LOC_LAT0"]) == (0.12, 5.0, 47.397743)
    assert "COM_OBL_ACT" not in new


def test_the_mocks_own_values_are_laid_over(pilot):
    vehicle = MockConfig.model_validate({"vehicle": {"mass_kg": 1.5, "arm_m": 0.3}}).vehicle.params()
    values = {row.name: row.value for row in px4_parameters("1.16", 7, 0, vehicle)}
    assert (values["MAV_SYS_ID"], values["COM_RCL_EXCEPT"], values["SIH_MASS"]) == (7, 0, 1.5)
    assert (values["SIH_L_ROLL"], values["MIS_TAKEOFF_ALT"], values["MPC_XY_P"]) == (0.3, 2.5, 0.95)
    assert len(values) == 893
