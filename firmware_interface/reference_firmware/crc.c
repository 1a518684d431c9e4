#include "crc.h"

uint16_t crc16(const uint8_t *bytes, size_t length)
{
    uint16_t crc = 0xffffu;
    for (size_t n = 0; n < length; n++) {
        crc ^= bytes[n];
        for (int bit = 0; bit < 8; bit++) {
            crc = (uint16_t)((crc >> 1) ^ ((crc & 1u) ? 0xa001u : 0u));
        }
    }
    return crc;
}

/* Half a byte at a time: a page takes a quarter of the time that single bits would, and the
 * table a sixteenth of the memory of one for bytes. */
static uint32_t crc32_of_half(uint32_t crc, uint32_t half)
{
    static const uint32_t table[16] = {
        0x00000000u, 0x1db71064u, 0x3b6e20c8u, 0x26d930acu, 0x76dc4190u, 0x6b6b51f4u,
        0x4db26158u, 0x5005713cu, 0xedb88320u, 0xf00f9344u, 0xd6d6a3e8u, 0xcb61b38cu,
        0x9b64c2b0u, 0x86d3d2d4u, 0xa00ae278u, 0xbdbdf21cu,
    };
    return (crc >> 4) ^ table[(crc ^ half) & 0xfu];
}

uint32_t crc32_of_words(const uint16_t *words, size_t count)
{
    return crc32_of_more(0, words, count);
}

uint32_t crc32_of_more(uint32_t before, const uint16_t *words, size_t count)
{
    uint32_t crc = ~before;
    for (size_t n = 0; n < count; n++) {
        const uint32_t high = (uint32_t)words[n] >> 8, low = words[n] & 0xffu;
        crc = crc32_of_half(crc32_of_half(crc, high), high >> 4);
        crc = crc32_of_half(crc32_of_half(crc, low), low >> 4);
    }
    return ~crc;
}
