/* Checksums of frames and of what the host reads in several words. */
#ifndef CRC_H
#define CRC_H

#include <stddef.h>
#include <stdint.h>

/* CRC-16 of a Modbus RTU frame. */
uint16_t crc16(const uint8_t *bytes, size_t length);

/* CRC-32 (zlib's) of words taken as big-endian bytes. */
uint32_t crc32_of_words(const uint16_t *words, size_t count);

/* The same of words that follow on others, of which it was this before. */
uint32_t crc32_of_more(uint32_t before, const uint16_t *words, size_t count);

#endif
