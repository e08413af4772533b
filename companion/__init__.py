"""What runs on the vehicle's Linux board: sees neighbours, picks a point of the formation, commands the firmware."""
