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

/* As the firmware of map 3 left it: the numbers up to the ripples. */
#define MAP_3_CRC 0x58329fe3u
#define MAP_3_BYTES offsetof(struct fd_gain_bank, friction_top_speed)
struct record_3 {
    uint32_t map_crc;
    uint32_t sequence;
    unsigned char gains[FD_AXES][MAP_3_BYTES];
    uint32_t crc;
};

static uint32_t writes;

/* Bytes taken as words: both sides of the check are this board. */
static uint32_t crc_of(const void *record, size_t size)
{
    uint32_t crc = 0;
    for (size_t at = 0; at < size; at += 2u) {
        uint16_t word;
        memcpy(&word, (const unsigned char *)record + at, sizeof word);
        crc = crc32_of_more(crc, &word, 1u);
    }
    return crc;
}

/* A record of map 3, the terms that came later off. */
static bool read_old(unsigned slot, struct record *record)
{
    struct record_3 old;
    if (!port_store_read(slot, &old, sizeof old) || old.map_crc != MAP_3_CRC
        || old.crc != crc_of(&old, offsetof(struct record_3, crc))) {
        return false;
    }
    record->map_crc = FD_MAP_CRC;
    record->sequence = old.sequence;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        record->gains[axis] = *gain_banks_off();
        memcpy(&record->gains[axis], old.gains[axis], MAP_3_BYTES);
    }
    return true;
}

static bool read_slot(unsigned slot, struct record *record)
{
    const bool found = port_store_read(slot, record, sizeof *record)
        && record->crc == crc_of(record, offsetof(struct record, crc));
    return found || read_old(slot, record);
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
    struct record record;
    const uint32_t sequence = writes + 1u; /* the counter outlives a memory that lost its records */
    const unsigned last = newest(&record);
    if (last != STORE_SLOTS && holds(&record, gains)) {
        return true;
    }
    const unsigned slot = last == STORE_SLOTS ? 0u : (last + 1u) % STORE_SLOTS;
    record.sequence = sequence;
    record.map_crc = FD_MAP_CRC;
    memcpy(record.gains, gains, sizeof record.gains);
    record.crc = crc_of(&record, offsetof(struct record, crc));
    if (!port_store_write(slot, &record, sizeof record) || !read_slot(slot, &record)
        || record.sequence != sequence) {
        return false;
    }
    writes = sequence;
    return true;
}

uint32_t gain_store_writes(void)
{
    return writes;
}
