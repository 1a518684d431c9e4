/* The capture: samples into pages, pages into the ring of slots that the host reads.
 * Filled by the sample interrupt; in the main loop, hold the lock. */
#ifndef CAPTURE_RING_H
#define CAPTURE_RING_H

#include <stdbool.h>
#include <stdint.h>

#include "drive.h"

/* Begin a new capture. */
void capture_ring_clear(void);

/* Take a sample; write the page that it completes. */
void capture_ring_add(const struct drive_sample *sample);

/* Write the samples that are pending, as a short page if need be. */
void capture_ring_flush(void);

/* The host holds every page. */
bool capture_ring_drained(void);

/* Since the last clear. */
uint32_t capture_ring_samples(void);

/* Word of the page slots, counted from the first. */
uint16_t capture_ring_word(uint32_t offset);

/* Put the counters where the host reads them. */
void capture_ring_publish(void);

#endif
