"""The reference logs: where they are, and what is in them. They are not part of the project."""

from __future__ import annotations

import os
from pathlib import Path

LOGS = Path(os.environ.get("MAVQUAD_TLOGS") or Path(__file__).resolve().parents[2] / "shared" / "tlogs")

FRAMES_OF = {
    "ac_cybersim_4hz_v2.tlog": (24794, 0),
    "ac_dronekit_v1.tlog": (75477, 0),
    "ac_galfy_swarm_v2.raw": (29119, 0),
    "ac_galfy_swarm_v2.tlog": (30902, 0),
    "ac_gridlines_kresge01_v1_trunc.tlog": (7656, 0),
    "ac_lucagemma_corrupt_v1v2.tlog": (9514, 0),
    "ac_tlog_mixed_v1v2.tlog": (10277, 0),
    "ac_wlichon_hbspoof_v1v2.tlog": (10182, 0),
    "px4_semvdh_hexa_46hz_v2.tlog": (4520, 30),
    "arducopter-4.7-a_connect_params_arm_takeoff_hover30_land.tlog": (41022, 0),
    "arducopter-4.7-b_guided_bodyrate_thrust_hover.tlog": (31222, 0),
    "arducopter-4.7-c1_rejected.tlog": (5711, 0),
    "arducopter-4.7-c2_setpoint_stream_stops.tlog": (34588, 0),
    "arducopter-4.7-c3_gcs_heartbeat_lost_rtl.tlog": (11222, 0),
    "px4-v1.13.3-a.tlog": (40794, 94),
    "px4-v1.13.3-c-reject.tlog": (19611, 51),
    "px4-v1.13.3-d-actuator139.tlog": (51675, 77),
    "px4-v1.16.2-a.tlog": (30024, 151),
    "px4-v1.16.2-b.tlog": (51354, 195),
    "px4-v1.16.2-c-reject.tlog": (20943, 91),
    "px4-v1.16.2-c-stop.tlog": (21800, 108),
}
"""Good frames, and frames of messages that the dialect does not know."""
