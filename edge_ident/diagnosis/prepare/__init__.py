"""From recordings to what is compared: the band, the samples that count, the data's quality."""
