"""The way to a board: ports and devices, checks of host and link, single registers."""
