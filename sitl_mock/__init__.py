"""A mock autopilot that speaks MAVLink and flies a rigid-body quadcopter; plain Python, no hardware."""
