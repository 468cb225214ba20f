"""How a given autopilot behaves on the wire."""
