"""What PX4's parameters say, as the mock flies by it: read once after each change, not in every tick."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any

from sitl_mock.personality.params import ParameterServer


@dataclass(frozen=True, slots=True)
class Settings:
    """Times in s, lengths in m, speeds in m/s, angles in degrees as PX4 has them; the defaults are PX4's.

    Each field is the parameter of the same name in capitals. One that the release lacks keeps the default here.
    """

    com_of_loss_t: float = 1.0
    com_obl_act: int = 0
    com_obl_rc_act: int = 0
    com_rcl_except: int = 0
    com_rcl_act_t: float = 15.0
    com_rc_loss_t: float = 0.5
    com_rc_override: int = 1
    com_dl_loss_t: float = 10.0
    com_fail_act_t: float = 5.0
    com_bat_act_t: float = 5.0
    com_low_bat_act: int = 0
    com_disarm_land: float = 2.0
    com_disarm_prflt: float = 10.0
    nav_dll_act: int = 0
    nav_rcl_act: int = 2
    gf_action: int = 2
    bat_low_thr: float = 0.15
    bat_crit_thr: float = 0.07
    bat_emergen_thr: float = 0.05
    mis_takeoff_alt: float = 2.5
    nav_acc_rad: float = 2.0
    nav_mc_alt_rad: float = 0.8
    rtl_return_alt: float = 60.0
    rtl_descend_alt: float = 30.0
    rtl_land_delay: float = 0.0
    rtl_min_dist: float = 10.0
    rtl_cone_ang: float = 45.0
    mpc_tko_speed: float = 1.5
    mpc_tko_ramp_t: float = 3.0
    mpc_land_speed: float = 0.7
    mpc_land_crwl: float = 0.3
    mpc_land_alt1: float = 10.0
    mpc_land_alt2: float = 5.0
    mpc_land_alt3: float = 1.0
    mpc_xy_cruise: float = 5.0
    mpc_xy_vel_max: float = 12.0
    mpc_z_vel_max_up: float = 3.0
    mpc_z_vel_max_dn: float = 1.5
    mpc_z_v_auto_up: float = 3.0
    mpc_z_v_auto_dn: float = 1.5
    mpc_acc_hor: float = 3.0
    mpc_vel_manual: float = 10.0
    mpc_man_tilt_max: float = 35.0
    mpc_man_y_max: float = 150.0
    mpc_tiltmax_air: float = 45.0
    mpc_yawrauto_max: float = 45.0
    mc_rollrate_max: float = 220.0
    mc_pitchrate_max: float = 220.0
    mc_yawrate_max: float = 200.0
    mc_acro_r_max: float = 100.0
    mc_acro_p_max: float = 100.0
    mc_acro_y_max: float = 100.0

    @classmethod
    def read(cls, params: ParameterServer) -> Settings:
        """The settings that these parameters mean; numbers that nothing could fly by are brought into a range."""
        values: dict[str, Any] = {}
        for each in fields(cls):
            try:
                value = params[each.name.upper()]
            except KeyError:
                continue
            is_whole = each.type == "int"
            values[each.name] = int(value) if is_whole else _sane(each.name, float(value))
        return cls(**values)


_SPEEDS = ("speed", "crwl", "cruise", "vel_max", "v_auto", "vel_manual", "acc_hor")
_RATES = ("rate_max", "rauto_max", "y_max", "r_max", "p_max", "tiltmax", "tilt_max")


def _sane(name: str, value: float) -> float:
    if any(part in name for part in _SPEEDS):
        return min(100.0, max(0.05, value))
    if name.startswith("mpc_tilt") or "tilt" in name:
        return min(89.0, max(1.0, value))
    if any(part in name for part in _RATES):
        return min(1800.0, max(0.0, value))
    return value if math.isfinite(value) else 0.0
