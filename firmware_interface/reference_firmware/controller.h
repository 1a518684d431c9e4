/* The control law of one axis, in full in firmware_interface/gains.py. [sample] */
#ifndef CONTROLLER_H
#define CONTROLLER_H

#include <stdbool.h>
#include <stdint.h>

#include "../registers.h"

/* Where an axis should be. */
struct setpoint {
    float position_rad;
    float velocity_rad_s;
    float acceleration_rad_s2;
};

/* What the law remembers. */
struct controller {
    int32_t last_counts;
    float velocity_rad_s;
    float integral_nm;
};

/* Forget the past: the axis stands still at this position. */
void controller_reset(struct controller *controller, int32_t counts);

/* Effort for the position just latched, within +-limit_nm; where it comes out as no finite number
 * it is 0, and *finite is cleared. */
float controller_effort_nm(struct controller *controller, const struct fd_gain_bank *gains,
                           const struct setpoint *setpoint, int32_t counts, float rad_per_count,
                           float limit_nm, bool *finite);

/* [both] What the reference alone asks for: the effort where the axis follows exactly. */
float controller_feedforward_nm(const struct fd_gain_bank *gains, const struct setpoint *setpoint);

#endif
