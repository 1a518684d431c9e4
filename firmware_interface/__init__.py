"""The contract with the board: register map, codec, link, board verbs, virtual board."""
