"""The methods that a sceptical control engineer would name, side by side on the same samples."""
