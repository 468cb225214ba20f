"""The command exchange: repeated until answered, counted, replaced; refusals behind an acceptance."""

from __future__ import annotations

import math

import pytest

from mavquad.endpoint import NEVER_US
from mavquad.protocol import command as commands
from mavquad.protocol.codec import mavlink
from mavquad.protocol.command import MAX_TRIES, RETRY_US, CommandExchange, Reply, result_name
from mavquad.protocol.firmware import ARDUCOPTER, PX4, px4

TARGET = (3, 4)
ARM = commands.arm()
LAND = commands.land(PX4)


def ack(command=ARM, result=mavlink.MAV_RESULT_ACCEPTED):
    return mavlink.MAVLink_command_ack_message(command.command_id, result)


def started(command=ARM, now_us=1000):
    exchange = CommandExchange()
    exchange.request(command, TARGET, now_us)
    return exchange


def test_a_request_goes_out_at_once_to_the_target():
    message = CommandExchange().request(ARM, TARGET, 1000)
    assert (message.target_system, message.target_component) == TARGET
    assert (message.command, message.confirmation, message.param1, message.param2) == (400, 0, 1.0, 0.0)


def test_nothing_pending_at_first():
    exchange = CommandExchange()
    assert not exchange.pending
    assert exchange.next_deadline_us() == NEVER_US
    assert exchange.on_ack(ack()) is None


def test_it_is_repeated_at_its_time_with_a_confirmation_that_counts():
    exchange = started()
    for count in (1, 2, 3):
        due_us = 1000 + count * RETRY_US
        assert exchange.next_deadline_us() == due_us
        assert exchange.on_deadline(TARGET, due_us - 4) is None
        message = exchange.on_deadline(TARGET, due_us)
        assert (message.command, message.confirmation) == (400, count)
        assert exchange.tries == count + 1


def test_it_gives_up_after_its_last_try():
    exchange = started(now_us=0)
    sent = 1
    while (reply := exchange.on_deadline(TARGET, exchange.next_deadline_us())) is not Reply.TIMEOUT:
        assert reply.confirmation == sent
        sent += 1
    assert sent == exchange.tries == MAX_TRIES == 20
    assert not exchange.pending
    assert exchange.requested_us == 0


@pytest.mark.parametrize(
    ("result", "reply", "name"),
    [
        (mavlink.MAV_RESULT_ACCEPTED, Reply.ACCEPTED, "ACCEPTED"),
        (mavlink.MAV_RESULT_TEMPORARILY_REJECTED, Reply.REFUSED, "TEMPORARILY_REJECTED"),
        (mavlink.MAV_RESULT_DENIED, Reply.REFUSED, "DENIED"),
        (mavlink.MAV_RESULT_UNSUPPORTED, Reply.REFUSED, "UNSUPPORTED"),
        (mavlink.MAV_RESULT_FAILED, Reply.REFUSED, "FAILED"),
        (200, Reply.REFUSED, "result 200"),
    ],
)
def test_an_answer_ends_the_repetition(result, reply, name):
    exchange = started()
    assert exchange.on_ack(ack(result=result)) is reply
    assert exchange.result == name
    assert exchange.next_deadline_us() == NEVER_US
    assert exchange.on_deadline(TARGET, 10**9) is None


def test_in_progress_is_no_answer():
    exchange = started()
    assert exchange.on_ack(ack(result=mavlink.MAV_RESULT_IN_PROGRESS)) is None
    assert exchange.pending
    assert exchange.result == ""


def test_a_refusal_counts_also_behind_an_acceptance():
    exchange = started()
    exchange.on_ack(ack())
    assert exchange.on_ack(ack(result=mavlink.MAV_RESULT_TEMPORARILY_REJECTED)) is Reply.REFUSED
    assert exchange.result == "TEMPORARILY_REJECTED"


def test_the_answer_to_another_command_is_not_ours():
    exchange = started()
    assert exchange.on_ack(ack(LAND)) is None
    assert exchange.pending


def test_a_new_command_replaces_what_is_pending():
    exchange = started()
    exchange.on_deadline(TARGET, 1000 + RETRY_US)
    exchange.request(LAND, TARGET, 900_000)
    assert exchange.on_ack(ack(ARM)) is None
    assert (exchange.command, exchange.tries, exchange.requested_us) == (LAND, 1, 900_000)
    assert exchange.on_deadline(TARGET, 900_000 + RETRY_US).command == LAND.command_id


def test_the_result_of_the_command_before_is_forgotten():
    exchange = started()
    exchange.on_ack(ack())
    exchange.request(LAND, TARGET, 5000)
    assert exchange.result == ""


def test_a_cancelled_command_is_neither_repeated_nor_answered():
    exchange = started()
    exchange.cancel()
    assert not exchange.pending
    assert exchange.on_deadline(TARGET, 10**9) is None
    assert exchange.on_ack(ack()) is None


def parameters(command):
    message = command.message(TARGET, 0)
    return message.command, [getattr(message, f"param{i}") for i in range(1, 8)]


@pytest.mark.parametrize(
    ("command", "command_id", "values"),
    [
        (commands.arm(), 400, [1, 0, 0, 0, 0, 0, 0]),
        (commands.disarm(), 400, [0, 0, 0, 0, 0, 0, 0]),
        (commands.takeoff(PX4, 12.5), 22, [math.nan, 0, 0, math.nan, math.nan, math.nan, math.nan]),
        (commands.takeoff(ARDUCOPTER, 12.5), 22, [0, 0, 0, 0, 0, 0, 12.5]),
        (commands.land(ARDUCOPTER), 176, [1, 9, 0, 0, 0, 0, 0]),
        (commands.land(PX4), 21, [0, 0, 0, math.nan, math.nan, math.nan, math.nan]),
        (commands.set_mode(px4.LOITER), 176, [1, 4, 3, 0, 0, 0, 0]),
        (commands.set_interval("ATTITUDE", 30, 250.0), 511, [30, 4000, 0, 0, 0, 0, 0]),
        (commands.set_interval("ATTITUDE", 30, 0.0), 511, [30, -1, 0, 0, 0, 0, 0]),
        (commands.request_message("AUTOPILOT_VERSION", 148), 512, [148, 0, 0, 0, 0, 0, 0]),
    ],
    ids=lambda value: getattr(value, "words", ""),
)
def test_the_commands(command, command_id, values):
    sent_id, sent = parameters(command)
    assert sent_id == command_id
    assert repr([float(v) for v in sent]) == repr([float(v) for v in values])


def test_disarming_is_never_forced():
    assert parameters(commands.disarm())[1][1] == 0.0


def test_result_names():
    assert result_name(1) == "TEMPORARILY_REJECTED"
    assert result_name(77) == "result 77"
