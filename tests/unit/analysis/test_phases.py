"""Flight phases by HEARTBEAT and EXTENDED_SYS_STATE."""

from __future__ import annotations

from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavquad.analysis.phases import flight_phases

ME = (1, 1)
GUIDED, LAND = 4, 9


def beats(log, from_s, to_s, armed, mode, autopilot=3, vehicle_type=2):
    for second in range(from_s, to_s):
        log.add(second, dialect.MAVLink_heartbeat_message(vehicle_type, autopilot, armed * 128, mode, 4, 3))


def landed(log, *told):
    for t_s, state in told:
        log.add(t_s, dialect.MAVLink_extended_sys_state_message(0, state))


def seen(log):
    return [(phase.mode, phase.from_s, phase.to_s) for phase in flight_phases(log.contents(), ME)]


def test_armed_spans_are_cut_where_the_mode_changes(log):
    beats(log, 0, 5, False, GUIDED)
    beats(log, 5, 10, True, GUIDED)
    beats(log, 10, 15, True, LAND)
    beats(log, 15, 18, False, LAND)
    beats(log, 18, 20, True, LAND)
    assert seen(log) == [("GUIDED", 5.0, 10.0), ("LAND", 10.0, 15.0), ("LAND", 18.0, 19.0)]
    assert not flight_phases(log.contents(), ME)[0].landed_told


def test_time_on_the_ground_is_left_out_where_the_log_tells_it(log):
    landed(log, (0, 1))
    beats(log, 0, 20, True, GUIDED)
    landed(log, (4.5, 3), (6.5, 2), (12.5, 1), (15.5, 0))
    assert seen(log) == [("GUIDED", 4.5, 12.5)]
    assert flight_phases(log.contents(), ME)[0].landed_told


def test_until_the_log_tells_it_an_armed_vehicle_flies(log):
    beats(log, 0, 20, True, GUIDED)
    landed(log, (12.5, 4), (15.5, 1))
    assert seen(log) == [("GUIDED", 0.0, 15.5)]


def test_what_others_claim_under_its_name_does_not_enter(log):
    beats(log, 0, 10, True, GUIDED)
    for second in range(10):
        log.add(second + 0.5, dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
    assert seen(log) == [("GUIDED", 0.0, 9.0)]


def test_a_blink_is_no_phase(log):
    beats(log, 0, 5, True, GUIDED)
    log.add(5.2, dialect.MAVLink_heartbeat_message(2, 3, 128, LAND, 4, 3))
    beats(log, 6, 10, True, GUIDED)
    assert seen(log) == [("GUIDED", 0.0, 5.2), ("GUIDED", 6.0, 9.0)]


def test_no_heartbeats(log):
    log.attitude(0, 0, 0, 0)
    assert seen(log) == []
