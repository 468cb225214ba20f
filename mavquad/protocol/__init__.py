"""MAVLink: bytes, messages, and the small exchanges with a vehicle; no input or output."""
