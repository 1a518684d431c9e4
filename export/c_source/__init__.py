"""An int8 network as C99 for a microcontroller: read its graph, lay it out, write the files."""
