"""ArduCopter's manners: 4.7, as its SITL showed them."""
