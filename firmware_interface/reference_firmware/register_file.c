#include "register_file.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "crc.h"

struct entry {
    uint16_t address;
    uint8_t value_words;
    uint8_t values;
    uint8_t writable;
    uint32_t lowest;
    uint32_t highest;
};

#define ENTRY(address, words, values, writable, lowest, highest) \
    {address, words, values, writable, lowest, highest},
static const struct entry entries[] = {FD_REGISTERS(ENTRY)};
#define ENTRIES (sizeof entries / sizeof entries[0])

static uint16_t stored[FD_REG_END];

void register_file_init(void)
{
    memset(stored, 0, sizeof stored);
}

uint16_t register_u16(uint16_t address)
{
    return stored[address];
}

uint32_t register_u32(uint16_t address)
{
    return (uint32_t)stored[address] << 16 | stored[address + 1u];
}

float register_f32(uint16_t address)
{
    const uint32_t raw = register_u32(address);
    float value;
    memcpy(&value, &raw, sizeof value);
    return value;
}

void register_put_u16(uint16_t address, uint16_t value)
{
    stored[address] = value;
}

void register_put_u32(uint16_t address, uint32_t value)
{
    stored[address] = (uint16_t)(value >> 16);
    stored[address + 1u] = (uint16_t)value;
}

void register_put_f32(uint16_t address, float value)
{
    uint32_t raw;
    memcpy(&raw, &value, sizeof raw);
    register_put_u32(address, raw);
}

/* ---- gain banks: a row of floats in memory, as registers.h asserts; two in the map, since those
 * of map 4 stand in another place */

#define BANK_FLOATS (sizeof(struct fd_gain_bank) / sizeof(float))
#define FIRST_FLOATS (offsetof(struct fd_gain_bank, friction_top_speed) / sizeof(float))
#define FIRST_WORDS (2u * FIRST_FLOATS)
#define LATER_WORDS (2u * (BANK_FLOATS - FIRST_FLOATS))

struct gain_place {
    uint16_t first, first_stride; /* words from one axis to the next */
    uint16_t later, later_stride;
};

#define PLACE(group) \
    {FD_REG_##group##_X_PROPORTIONAL, \
     FD_REG_##group##_Z_PROPORTIONAL - FD_REG_##group##_X_PROPORTIONAL, \
     FD_REG_##group##_X_FRICTION_TOP_SPEED, \
     FD_REG_##group##_Z_FRICTION_TOP_SPEED - FD_REG_##group##_X_FRICTION_TOP_SPEED}
static const struct gain_place gain_places[] = {PLACE(ACTIVE), PLACE(SHADOW), PLACE(GAIN_MAXIMUM)};

static uint16_t gain_address(enum gain_group group, unsigned axis, unsigned n)
{
    const struct gain_place *place = &gain_places[group];
    const unsigned first = place->first + axis * place->first_stride + 2u * n;
    const unsigned later = place->later + axis * place->later_stride + 2u * (n - FIRST_FLOATS);
    return (uint16_t)(n < FIRST_FLOATS ? first : later);
}

void register_take_gains(enum gain_group group, struct fd_gain_bank gains[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        float row[BANK_FLOATS];
        for (unsigned n = 0; n < BANK_FLOATS; n++) {
            row[n] = register_f32(gain_address(group, axis, n));
        }
        memcpy(&gains[axis], row, sizeof row);
    }
}

void register_put_gains(enum gain_group group, const struct fd_gain_bank gains[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        float row[BANK_FLOATS];
        memcpy(row, &gains[axis], sizeof row);
        for (unsigned n = 0; n < BANK_FLOATS; n++) {
            register_put_f32(gain_address(group, axis, n), row[n]);
        }
    }
}

uint32_t register_gains_crc(enum gain_group group)
{
    uint32_t crc = 0;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        crc = crc32_of_more(crc, &stored[gain_address(group, axis, 0)], FIRST_WORDS);
    }
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        crc = crc32_of_more(crc, &stored[gain_address(group, axis, FIRST_FLOATS)], LATER_WORDS);
    }
    return crc;
}

/* ---- words */

const uint16_t *register_words(uint16_t address)
{
    return &stored[address];
}

static uint32_t end_of(const struct entry *entry)
{
    return (uint32_t)entry->address + (uint32_t)entry->value_words * entry->values;
}

/* Whether an address is one at which a value of the register begins or ends. */
static bool between_values(const struct entry *entry, uint32_t address)
{
    return (address - entry->address) % entry->value_words == 0;
}

/* Whether the host may write this part of a register. */
static bool writable(const struct entry *entry, uint32_t address, uint32_t end)
{
    return entry->writable && between_values(entry, address)
        && (end >= end_of(entry) || between_values(entry, end));
}

/* Whether registers cover all words, without a hole. */
static bool covered(uint32_t address, uint32_t end, bool to_write)
{
    for (size_t n = 0; n < ENTRIES && address < end; n++) {
        const struct entry *entry = &entries[n];
        if (entry->address <= address && address < end_of(entry)) {
            if (to_write && !writable(entry, address, end)) {
                return false;
            }
            address = end_of(entry);
        }
    }
    return address >= end;
}

enum access register_file_read(uint16_t address, uint16_t count, uint16_t *words)
{
    if (!covered(address, (uint32_t)address + count, false)) {
        return ACCESS_NO_REGISTER;
    }
    memcpy(words, &stored[address], count * sizeof *words);
    return ACCESS_DONE;
}

/* Whether every value stays in its range. Only single values have one, and they come whole. */
static bool in_range(uint32_t address, uint32_t end, const uint16_t *words)
{
    for (size_t n = 0; n < ENTRIES; n++) {
        const struct entry *entry = &entries[n];
        uint32_t raw = 0;
        if (entry->address < address || end <= entry->address || entry->highest == UINT32_MAX) {
            continue;
        }
        for (uint32_t at = entry->address; at < end_of(entry); at++) {
            raw = raw << 16 | words[at - address];
        }
        if (raw < entry->lowest || raw > entry->highest) {
            return false;
        }
    }
    return true;
}

enum access register_file_check(uint16_t address, uint16_t count, const uint16_t *words)
{
    const uint32_t end = (uint32_t)address + count;
    if (!covered(address, end, true)) {
        return ACCESS_NO_REGISTER;
    }
    return in_range(address, end, words) ? ACCESS_DONE : ACCESS_BAD_VALUE;
}

void register_file_write(uint16_t address, uint16_t count, const uint16_t *words)
{
    memcpy(&stored[address], words, count * sizeof *words);
}
