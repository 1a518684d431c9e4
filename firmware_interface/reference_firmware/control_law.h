/* What the reference alone asks for of an axis: the law in full is in
 * firmware_interface/control_law.py. [both] */
#ifndef CONTROL_LAW_H
#define CONTROL_LAW_H

#include "../registers.h"

/* Of two axes. */
#define OTHER_AXIS(axis) (1u - (axis))
FD_ASSERT(two_axes, FD_AXES == 2u);

/* Where an axis should be. */
struct setpoint {
    float position_rad;
    float velocity_rad_s;
    float acceleration_rad_s2;
};

/* What the law remembers of the reference. */
struct law_memory {
    float reference_rad; /* of the last sample */
    float presliding; /* z, between -1 and 1 */
    float backlash_rad; /* b */
};

/* Forget the past: the reference stands here. */
void law_reset(struct law_memory *memory, float reference_rad);

/* Go on with other gains: forget what their terms do not have. */
void law_keep(struct law_memory *memory, const struct fd_gain_bank *gains);

/* Follow the reference to the next sample. */
void law_step(struct law_memory *memory, const struct fd_gain_bank *gains, float reference_rad);

/* Feed-forward at a setpoint to which the memory was stepped; `other` is the other axis's. */
float law_feedforward_nm(const struct fd_gain_bank *gains, const struct setpoint *setpoint,
                         const struct setpoint *other, const struct law_memory *memory);

/* The output that has this effort behind the actuator's dead band. */
float law_output_nm(const struct fd_gain_bank *gains, float effort_nm);

#endif
