"""A board without hardware: register map, state machine and the feed drive behind it."""
