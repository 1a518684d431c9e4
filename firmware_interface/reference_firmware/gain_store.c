#include "gain_store.h"

#include <stddef.h>
#include <string.h>

#include "crc.h"
#include "gain_banks.h"
#include "port.h"

struct record {
    uint32_t map_crc; /* gains of another map may mean something else */
    uint32_t sequence;
    struct fd_gain_bank gains[FD_AXES];
    uint32_t crc; /* of everything before */
};

/* Bytes taken as words: both sides of the check are this board. */
static uint32_t crc_of(const struct record *record)
{
    uint16_t words[offsetof(struct record, crc) / 2u];
    memcpy(words, record, sizeof words);
    return crc32_of_words(words, sizeof words / sizeof words[0]);
}

static bool read_slot(unsigned slot, struct record *record)
{
    return port_store_read(slot, record, sizeof *record) && record->crc == crc_of(record)
        && record->map_crc == FD_MAP_CRC;
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
    if (newest(&record) == STORE_SLOTS || !gain_banks_within_maxima(record.gains)) {
        return false;
    }
    memcpy(gains, record.gains, sizeof record.gains);
    return true;
}

bool gain_store_save(const struct fd_gain_bank gains[FD_AXES])
{
    struct record record, back;
    const unsigned last = newest(&record);
    const unsigned slot = last == STORE_SLOTS ? 0u : (last + 1u) % STORE_SLOTS;
    record.sequence = last == STORE_SLOTS ? 1u : record.sequence + 1u;
    record.map_crc = FD_MAP_CRC;
    memcpy(record.gains, gains, sizeof record.gains);
    record.crc = crc_of(&record);
    return port_store_write(slot, &record, sizeof record) && read_slot(slot, &back)
        && back.sequence == record.sequence;
}
