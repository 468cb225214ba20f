"""The flight: guards, the state machine and the missions."""
