/* Bumpless transfer: how other gains go on from where the control law is. In full in
 * firmware_interface/control_law.py. [sample] */
#ifndef TRANSFER_H
#define TRANSFER_H

#include "controller.h"

/* One sample of all axes, and the gains in force. */
struct transfer_from {
    const struct controller *controllers;
    const struct fd_gain_bank *gains;
    const struct setpoint *setpoints;
    const int32_t *counts;
    const float *limit_nm; /* of the effort */
    float rad_per_count;
    bool moving; /* the axes are on their way to rest */
};

/* What other gains would make of it. */
struct transfer {
    struct controller controllers[FD_AXES]; /* bridged: they go on from those in force */
    struct setpoint setpoints[FD_AXES]; /* where they begin */
    float jump_nm[FD_AXES]; /* what they ask for, less the effort of those in force */
};

/* Nothing changes. A jump may come out as no number. */
void transfer_consider(struct transfer *transfer, const struct fd_gain_bank gains[FD_AXES],
                       const struct transfer_from *from);

#endif
