"""What is particular to one autopilot: its modes and its setpoints."""
