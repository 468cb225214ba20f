"""PX4's answers to commands: COMMAND_LONG, COMMAND_INT and the old SET_MODE, with their COMMAND_ACK.

What each command does stands in `flight_commands` and `system_commands`; a handler returns the results to acknowledge,
one ACK each: PX4 has several modules, and some commands are answered by two of them and some by none.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from mavquad.protocol.codec import Message, mavlink
from sitl_mock.config import Px4Release
from sitl_mock.config.faults import Refuse
from sitl_mock.geodesy import Origin
from sitl_mock.personality import Sender
from sitl_mock.personality.px4.command import ACCEPTED, CRITICAL, FAILED, UNSUPPORTED, Command, Handler
from sitl_mock.personality.px4.commander import Commander
from sitl_mock.personality.px4.flight_commands import FlightCommands
from sitl_mock.personality.px4.system_commands import SystemCommands
from sitl_mock.port import AUTOPILOT_COMPONENT, Port
from sitl_mock.script import Script

_SET_MODE: int = mavlink.MAV_CMD_DO_SET_MODE
_NOT_A_NUMBER = 0x7FF80000
"""What stands in x and y of COMMAND_INT for NaN."""


class Commands:
    """Obeys commands.

    `send_message` sends the message with an id at once on a port, `set_interval` sets its rate there; both say whether
    there is such a message. `send_interval` sends the MESSAGE_INTERVAL in force there.
    """

    def __init__(
        self,
        firmware: Px4Release,
        system_id: int,
        commander: Commander,
        script: Script,
        origin: Origin,
        send_message: Callable[[Port, int, int], bool],
        set_interval: Callable[[Port, int, float, int], bool],
        send_interval: Callable[[Port, int], None],
    ) -> None:
        self._is_116 = firmware in ("1.16", "1.17")
        self._system_id = system_id
        self._commander = commander
        self._script = script
        flight = FlightCommands(commander, origin)
        system = SystemCommands(commander, send_message, set_interval, send_interval)
        self._handlers: dict[int, Handler] = {**flight.handlers, **system.handlers}

    def answer(self, message: Message, sender: Sender, port: Port, boot_us: int) -> list[Message]:
        """Obey a command message; the COMMAND_ACKs to send for it."""
        number = _SET_MODE if message.get_type() == "SET_MODE" else int(message.command)
        if message.target_system != self._system_id or not self._is_for_us(message):
            is_silent = self._is_116 or message.get_type() == "SET_MODE"
            return [] if is_silent else [_ack(number, FAILED, sender)]
        scripted = self._script.answer(number)
        if isinstance(scripted, Refuse):
            if scripted.text:
                self._commander.say(CRITICAL, scripted.text)
            return [_ack(number, scripted.result, sender)]
        if scripted is not None:
            return [_ack(number, ACCEPTED, sender)]
        handler = self._handlers.get(number)
        results = [UNSUPPORTED] if handler is None else handler(_command_of(message, sender, port, boot_us))
        if number == _SET_MODE and self._is_116 and message.get_type() != "SET_MODE":
            # The receiver of 1.16 acknowledges before its commander has decided.
            results = [ACCEPTED, *results]
        return [_ack(number, result, sender) for result in results]

    @staticmethod
    def _is_for_us(message: Message) -> bool:
        return message.get_type() == "SET_MODE" or message.target_component in (0, AUTOPILOT_COMPONENT)


def _command_of(message: Message, sender: Sender, port: Port, boot_us: int) -> Command:
    kind, m = message.get_type(), message
    if kind == "SET_MODE":
        main, sub = m.custom_mode >> 16 & 0xFF, m.custom_mode >> 24 & 0xFF
        return Command((m.base_mode, main, sub, 0.0, 0.0, 0.0, 0.0), sender, port, boot_us)
    if kind == "COMMAND_LONG":
        params = (m.param1, m.param2, m.param3, m.param4, m.param5, m.param6, m.param7)
        return Command(params, sender, port, boot_us)
    x, y = m.x * 1e-7, m.y * 1e-7
    if m.x == m.y == _NOT_A_NUMBER:
        x = y = math.nan
    return Command((m.param1, m.param2, m.param3, m.param4, x, y, m.z), sender, port, boot_us)


def _ack(command: int, result: int, sender: Sender) -> Message:
    return mavlink.MAVLink_command_ack_message(command, result, 0, 0, sender[0], sender[1])
