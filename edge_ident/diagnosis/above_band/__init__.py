"""Above the band of the comparison: lines in time and orders over position, at full bandwidth."""
