/* One period of a motion, as means over equal blocks that are added up while the samples come. */
#ifndef PERIOD_H
#define PERIOD_H

#include <stdbool.h>
#include <stdint.h>

#include "../drive.h"

#define PERIOD_BLOCKS 1024u

/* The means times the samples of the period, in counts; the position from its first sample on. */
struct period_axis {
    float position[PERIOD_BLOCKS];
    float effort[PERIOD_BLOCKS];
    double third_differences; /* of the position, the sum of their squares */
};

/* Begin with a period of so many samples: at least PERIOD_BLOCKS, or 0 for none. */
void period_begin(uint32_t samples);

/* [sample] What comes after the period is left out. */
void period_add(const struct drive_sample *sample);

uint32_t period_samples(void);
const struct period_axis *period_of(unsigned axis);

#endif
