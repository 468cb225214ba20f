"""PX4's parameters over MAVLink: an INT32 travels as its four bytes in the place of the float ('bytewise')."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.plant import VehicleParams

_INT32 = mavlink.MAV_PARAM_TYPE_INT32
_REAL32 = mavlink.MAV_PARAM_TYPE_REAL32


def to_wire(value: int | float) -> float:
    """The number that goes into PARAM_VALUE.param_value."""
    if isinstance(value, int):
        packed: float = struct.unpack("<f", struct.pack("<i", value))[0]
        return packed
    return value


def from_wire(wire: float, like: int | float) -> int | float:
    """The value that a PARAM_SET means for a parameter whose value is `like`; NaN and infinity change no REAL32."""
    if isinstance(like, int):
        whole: int = struct.unpack("<i", struct.pack("<f", wire))[0]
        return whole
    return wire if math.isfinite(wire) else like


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


class ParameterServer:
    """Holds the parameters and answers the parameter messages."""

    def __init__(self, values: dict[str, int | float]) -> None:
        self._values = values
        self._names = list(values)
        self._listing: Iterator[str] = iter(())

    def __getitem__(self, name: str) -> int | float:
        return self._values[name]

    def answer(self, message: Message) -> list[Message]:
        """What to send at once for PARAM_REQUEST_READ, PARAM_SET or PARAM_REQUEST_LIST; unknown names: nothing."""
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            self._listing = iter(list(self._names))
            return []
        name = message.param_id
        if kind == "PARAM_REQUEST_READ" and message.param_index >= 0:
            name = self._names[message.param_index] if message.param_index < len(self._names) else ""
        if name not in self._values:
            return []
        if kind == "PARAM_SET":
            self._values[name] = from_wire(message.param_value, self._values[name])
        return [self._value_message(name)]

    def next_of_list(self) -> Message | None:
        """The next message of a running list request; one a tick, as a real autopilot paces them."""
        name = next(self._listing, None)
        return None if name is None else self._value_message(name)

    def _value_message(self, name: str) -> Message:
        value = self._values[name]
        return mavlink.MAVLink_param_value_message(
            name.encode(),
            to_wire(value),
            _INT32 if isinstance(value, int) else _REAL32,
            len(self._names),
            self._names.index(name),
        )
