/* The capture: samples into pages, pages into the ring of slots that the host reads.
 * Filled by the sample interrupt; in the main loop, hold the lock. */
#ifndef CAPTURE_RING_H
#define CAPTURE_RING_H

#include <stdbool.h>
#include <stdint.h>

#include "drive.h"

/* Begin a new capture. */
void capture_ring_clear(void);

/* What the host reads. */
struct capture_counters {
    uint32_t pages_written;
    uint32_t samples;
    uint32_t overflows;
    uint32_t acknowledged; /* pages */
};
struct capture_counters capture_ring_counters(void);

/* Take a sample; write the page that it completes. */
void capture_ring_add(const struct drive_sample *sample);

/* Write the samples that are pending, as a short page if need be. */
void capture_ring_flush(void);

/* Whether the host may claim to hold so many pages: no more than were written. */
bool capture_ring_can_acknowledge(uint32_t pages);

/* It does; fewer than before change nothing. */
void capture_ring_acknowledge(uint32_t pages);

/* The host holds every page. */
bool capture_ring_drained(void);

/* Word of the page slots, counted from the first. */
uint16_t capture_ring_word(uint32_t offset);

#endif
