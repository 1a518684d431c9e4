/* From the means of a period to what the network is shown: filtered, differentiated, turned to the
 * phase of the network's motion, subsampled. edge_ident/signals/one_period.py does the same. */
#ifndef CONDITIONING_H
#define CONDITIONING_H

#include "fourier.h"
#include "identification_network.h"

/* One axis, SI: acceleration, velocity, its sign; the last column is the same everywhere. */
struct conditioned {
    double column[NETWORK_PARAMETERS - 1u][NETWORK_POINTS];
    double last_column;
    double effort[NETWORK_POINTS];
    double moving_share; /* of the period */
};

/* One axis as it was captured; the means are not yet divided by the samples. */
struct captured_axis {
    float position[PERIOD_BLOCKS];
    float effort[PERIOD_BLOCKS];
    double third_differences;
    uint32_t samples;
};

struct conditioning_memory {
    struct captured_axis captured;
    struct complex spectrum[PERIOD_BLOCKS];
    struct complex motion[PERIOD_BLOCKS]; /* velocity, acceleration */
    struct complex loads[PERIOD_BLOCKS]; /* direction, effort */
    double cosines[4u * NETWORK_POINTS];
    bool still[PERIOD_BLOCKS];
};

/* What memory->captured comes to. */
void condition(struct conditioning_memory *memory, struct conditioned *result);

#endif
