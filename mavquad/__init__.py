"""Robust output-feedback flight of quadcopters over MAVLink."""

__version__ = "0.1.0"
