/* The control law of one axis, in full in firmware_interface/control_law.py. [sample] */
#ifndef CONTROLLER_H
#define CONTROLLER_H

#include <stdbool.h>
#include <stdint.h>

#include "control_law.h"

/* What the law remembers. */
struct controller {
    int32_t last_counts;
    float velocity_rad_s;
    float integral_nm;
    float carried_nm; /* what is left of the bias that bridged an exchange of gains */
    float feedforward_nm; /* of the last sample, within the effort limit */
    struct law_memory memory;
};

/* Forget the past: the axis stands still at this position. */
void controller_reset(struct controller *controller, int32_t counts, float rad_per_count);

/* Other gains come into force where the axis stands: forget what the old ones left in the law. */
void controller_exchange(struct controller *controller, int32_t counts, float rad_per_count);

/* Take in what a sample brought. */
void controller_observe(struct controller *controller, const struct fd_gain_bank *gains,
                        float reference_rad, int32_t counts, float rad_per_count);

/* What the law asks for, neither bridged nor clipped; the rest as below. */
float controller_law_nm(struct controller *controller, const struct fd_gain_bank *gains,
                        const struct setpoint *setpoint, const struct setpoint *other,
                        int32_t counts, float rad_per_count, float limit_nm, bool *finite);

/* Effort for the position just latched, `other` being the other axis's setpoint, within
 * +-limit_nm; where it comes out as no finite number it is 0, and *finite is cleared. */
float controller_effort_nm(struct controller *controller, const struct fd_gain_bank *gains,
                           const struct setpoint *setpoint, const struct setpoint *other,
                           int32_t counts, float rad_per_count, float limit_nm, bool *finite);

#endif
