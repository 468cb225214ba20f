"""PX4's parameters at boot."""

from __future__ import annotations

from sitl_mock.config import Px4Release
from sitl_mock.personality.parameter_table import Parameter, ParameterValue, load_parameters
from sitl_mock.plant import VehicleParams

_TABLES: dict[Px4Release, str] = {
    "1.13": "parameters_1.13.csv",
    "1.14": "parameters_1.14.csv",
    "1.15": "parameters_1.15.csv",
    "1.16": "parameters_1.16.csv",
    "1.17": "parameters_1.17.csv",
}
_BURST_113_US, _BURST_US = 10_200, 20_000


def px4_parameters(
    release: Px4Release, system_id: int, com_rcl_except: int, vehicle: VehicleParams
) -> tuple[Parameter, ...]:
    """Every parameter as recorded from the release with SIH, with the mock's own values in place of some."""
    own = _own_values(system_id, com_rcl_except, vehicle)
    recorded = load_parameters(__package__, _TABLES[release])
    return tuple(row._replace(value=own.get(row.name, row.value)) for row in recorded)


def burst_us(release: Px4Release) -> int:
    """From one burst of a parameter list to the next, as recorded: 722 parameters in 0.37 s, 893 in 0.88 s."""
    return _BURST_113_US if release == "1.13" else _BURST_US


def _own_values(system_id: int, com_rcl_except: int, vehicle: VehicleParams) -> dict[str, ParameterValue]:
    return {
        "COM_RCL_EXCEPT": com_rcl_except,
        "MAV_SYS_ID": system_id,
        "MIS_TAKEOFF_ALT": 2.5,
        "SIH_IXX": vehicle.inertia_kg_m2[0],
        "SIH_IYY": vehicle.inertia_kg_m2[1],
        "SIH_IZZ": vehicle.inertia_kg_m2[2],
        "SIH_KDV": vehicle.linear_drag_n_s_m,
        "SIH_KDW": vehicle.angular_drag_nm_s_rad,
        "SIH_L_PITCH": vehicle.arm_m,
        "SIH_L_ROLL": vehicle.arm_m,
        "SIH_MASS": vehicle.mass_kg,
        "SIH_Q_MAX": vehicle.motor_torque_max_nm,
        "SIH_T_MAX": vehicle.motor_thrust_max_n,
        "SIH_T_TAU": vehicle.motor_time_constant_s,
    }
