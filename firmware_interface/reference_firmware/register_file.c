#include "register_file.h"

#include <stdbool.h>
#include <string.h>

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

/* A gain bank is a row of floats, in memory as in the map: registers.h asserts it. */
#define BANK_FLOATS (sizeof(struct fd_gain_bank) / sizeof(float))

void register_take_gains(uint16_t address, uint16_t stride, struct fd_gain_bank gains[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        float row[BANK_FLOATS];
        for (unsigned n = 0; n < BANK_FLOATS; n++) {
            row[n] = register_f32((uint16_t)(address + axis * stride + 2u * n));
        }
        memcpy(&gains[axis], row, sizeof row);
    }
}

void register_put_gains(uint16_t address, uint16_t stride,
                        const struct fd_gain_bank gains[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        float row[BANK_FLOATS];
        memcpy(row, &gains[axis], sizeof row);
        for (unsigned n = 0; n < BANK_FLOATS; n++) {
            register_put_f32((uint16_t)(address + axis * stride + 2u * n), row[n]);
        }
    }
}

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
