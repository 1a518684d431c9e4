#include "gain_store.h"

#include <stddef.h>
#include <string.h>

#include "crc.h"
#include "gain_banks.h"
#include "port.h"

struct record {
    uint32_t map_crc; /* gains of another map may mean something else */
    uint32_t sequence; /* of the write, from 1 on: their number, too */
    struct fd_gain_bank gains[FD_AXES];
    uint32_t crc; /* of everything before */
};

static uint32_t writes;

/* Bytes taken as words: both sides of the check are this board. */
static uint32_t crc_of(const struct record *record)
{
    uint16_t words[offsetof(struct record, crc) / 2u];
    memcpy(words, record, sizeof words);
    return crc32_of_words(words, sizeof words / sizeof words[0]);
}

static bool read_slot(unsigned slot, struct record *record)
{
    return port_store_read(slot, record, sizeof *record) && record->crc == crc_of(record);
}

/* Slot of the newest record, or STORE_SLOTS where there is none. */
static unsigned newest(struct record *found)
{
    unsigned best = STORE_SLOTS;
    for (unsigned slot = 0; slot < STORE_SLOTS; slot++) {
        struct record record;
        /* the difference tells newer from older across the wrap of the sequence, too */
        if (read_slot(slot, &record)
            && (best == STORE_SLOTS || (int32_t)(record.sequence - found->sequence) > 0)) {
            best = slot;
            *found = record;
        }
    }
    return best;
}

bool gain_store_load(struct fd_gain_bank gains[FD_AXES])
{
    struct record record;
    const bool found = newest(&record) != STORE_SLOTS;
    writes = found ? record.sequence : 0;
    if (!found || record.map_crc != FD_MAP_CRC || !gain_banks_within_maxima(record.gains)) {
        return false;
    }
    memcpy(gains, record.gains, sizeof record.gains);
    return true;
}

/* Whether a record holds these gains already. */
static bool holds(const struct record *record, const struct fd_gain_bank gains[FD_AXES])
{
    return record->map_crc == FD_MAP_CRC
        && memcmp(record->gains, gains, sizeof record->gains) == 0;
}

bool gain_store_save(const struct fd_gain_bank gains[FD_AXES])
{
    struct record record, back;
    const unsigned last = newest(&record);
    if (last != STORE_SLOTS && holds(&record, gains)) {
        return true;
    }
    const unsigned slot = last == STORE_SLOTS ? 0u : (last + 1u) % STORE_SLOTS;
    record.sequence = writes + 1u; /* the counter outlives a memory that lost its records */
    record.map_crc = FD_MAP_CRC;
    memcpy(record.gains, gains, sizeof record.gains);
    record.crc = crc_of(&record);
    if (!port_store_write(slot, &record, sizeof record) || !read_slot(slot, &back)
        || back.sequence != record.sequence) {
        return false;
    }
    writes = record.sequence;
    return true;
}

uint32_t gain_store_writes(void)
{
    return writes;
}
