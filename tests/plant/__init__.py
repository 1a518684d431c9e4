"""What a drive of firmware_interface.plant must do when an effect is hidden in it."""
