/* Whether a trajectory stays inside every limit, found out by walking through it: a few samples at
 * a time, since a long one takes minutes on a small processor. [main] */
#ifndef TRAJECTORY_CHECK_H
#define TRAJECTORY_CHECK_H

#include <stdbool.h>
#include <stdint.h>

#include "trajectory.h"

struct trajectory_check {
    struct trajectory walk; /* its next sample is the next to be looked at */
    struct fd_gain_bank gains[FD_AXES]; /* whose feed-forward must not ask for too much */
    struct law_memory memory[FD_AXES]; /* at the sample before */
    uint32_t samples_left;
    bool allowed; /* so far */
};

/* Begin, with a trajectory that has begun at the rest position, the gains in force, and what the
 * law of an axis remembers. */
void trajectory_check_begin(struct trajectory_check *check, const struct trajectory *trajectory,
                            const struct fd_gain_bank gains[FD_AXES],
                            const struct law_memory memory[FD_AXES]);

/* Look at so many samples at most; false where one is outside the limits. */
bool trajectory_check_go_on(struct trajectory_check *check, uint32_t samples);

#endif
