"""PX4's parameters at boot."""

from __future__ import annotations

from sitl_mock.plant import VehicleParams


def px4_defaults(system_id: int, com_rcl_except: int, vehicle: VehicleParams) -> dict[str, int | float]:
    """The parameters of the mock, by name: int for INT32, float for REAL32; values of PX4 1.13 with SIH."""
    values: dict[str, int | float] = {
        "COM_ARM_WO_GPS": 1,
        "COM_DISARM_LAND": 2.0,
        "COM_DISARM_PRFLT": 10.0,
        "COM_OBL_ACT": 0,
        "COM_OBL_RC_ACT": 0,
        "COM_OF_LOSS_T": 1.0,
        "COM_RCL_EXCEPT": com_rcl_except,
        "COM_RC_IN_MODE": 1,
        "MAV_COMP_ID": 1,
        "MAV_SYS_ID": system_id,
        "MAV_TYPE": 2,
        "MC_ROLLRATE_MAX": 220.0,
        "MC_YAWRATE_MAX": 200.0,
        "MIS_TAKEOFF_ALT": 2.5,
        "MPC_LAND_SPEED": 0.7,
        "MPC_THR_HOVER": 0.5,
        "MPC_THR_MAX": 1.0,
        "MPC_THR_MIN": 0.12,
        "MPC_TILTMAX_AIR": 45.0,
        "MPC_TKO_SPEED": 1.5,
        "NAV_DLL_ACT": 0,
        "NAV_RCL_ACT": 2,
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
        "SYS_AUTOSTART": 10040,
    }
    return dict(sorted(values.items()))
