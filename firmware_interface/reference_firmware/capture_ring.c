#include "capture_ring.h"

#include <string.h>

#include "crc.h"

#define BODY_WORDS (FD_PAGE_WORDS - 2u)

/* A page by its fields, and as the words that its CRC covers and the host reads. */
union page {
    struct fd_page fields;
    uint16_t words[FD_PAGE_WORDS];
};

static union page slots[FD_PAGE_SLOTS];
static union page pending;
static struct capture_counters counters;

static void put_u32(uint16_t words[2], uint32_t value)
{
    words[0] = (uint16_t)(value >> 16);
    words[1] = (uint16_t)value;
}

static int16_t saturated(int32_t value)
{
    return (int16_t)(value > INT16_MAX ? INT16_MAX : value < INT16_MIN ? INT16_MIN : value);
}

void capture_ring_clear(void)
{
    memset(&counters, 0, sizeof counters);
    memset(&pending, 0, sizeof pending);
}

struct capture_counters capture_ring_counters(void)
{
    return counters;
}

void capture_ring_add(const struct drive_sample *sample)
{
    const uint16_t row = pending.fields.count++;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        put_u32(pending.fields.sample[row][axis].position, (uint32_t)sample->position[axis]);
        pending.fields.sample[row][axis].effort = (uint16_t)sample->effort[axis];
        pending.fields.sample[row][axis].following_error =
            (uint16_t)saturated(sample->following_error[axis]);
    }
    counters.samples++;
    if (pending.fields.count == FD_PAGE_SAMPLES) {
        capture_ring_flush();
    }
}

void capture_ring_flush(void)
{
    if (pending.fields.count == 0) {
        return;
    }
    if (counters.pages_written - counters.acknowledged >= FD_PAGE_SLOTS) {
        counters.overflows++;
    }
    put_u32(pending.fields.index, counters.pages_written);
    put_u32(pending.fields.first_sample, counters.samples - pending.fields.count);
    put_u32(pending.fields.crc, crc32_of_words(pending.words, BODY_WORDS));
    slots[counters.pages_written % FD_PAGE_SLOTS] = pending;
    counters.pages_written++;
    memset(&pending, 0, sizeof pending);
}

bool capture_ring_can_acknowledge(uint32_t pages)
{
    return pages <= counters.pages_written;
}

void capture_ring_acknowledge(uint32_t pages)
{
    if (pages > counters.acknowledged) {
        counters.acknowledged = pages;
    }
}

bool capture_ring_drained(void)
{
    return counters.acknowledged == counters.pages_written;
}

uint16_t capture_ring_word(uint32_t offset)
{
    const uint32_t within = offset % FD_PAGE_SLOT_REGISTERS;
    return within < FD_PAGE_WORDS ? slots[offset / FD_PAGE_SLOT_REGISTERS].words[within] : 0;
}
