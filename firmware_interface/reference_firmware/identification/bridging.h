/* Standstills of an axis: found in its position, and bridged by straight lines in its signals. */
#ifndef BRIDGING_H
#define BRIDGING_H

#include <stdbool.h>

#include "fourier.h"

struct standstills {
    uint32_t turn; /* blocks by which the signals were turned */
    uint32_t width; /* blocks of the shortest standstill: a period of the cut-off */
    double largest_range; /* of the position in it */
    double samples; /* by which the positions are still multiplied */
};

/* Blocks in or near a standstill, at the turned places. */
void mark_standstills(const float position[PERIOD_BLOCKS], const struct standstills *rule,
                      bool still[PERIOD_BLOCKS]);

double moving_share(const bool still[PERIOD_BLOCKS]);

/* Nothing where the axis never stands or never moves. */
void bridge(struct complex signals[PERIOD_BLOCKS], const bool still[PERIOD_BLOCKS]);

#endif
