"""Robust output-feedback flight of quadcopters over MAVLink."""
