"""The version of edge-ident: the package is built with it, and what it writes names it.

A constant takes less than what is read of an installed package: that loads all that reads e-mail,
1 MiB and a twentieth of a command's start.
"""

VERSION = "0.1.0"
