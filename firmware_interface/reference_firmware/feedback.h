/* Whether the feedback of an axis is stable with the inertia and friction that the settings state.
 * [main] */
#ifndef FEEDBACK_H
#define FEEDBACK_H

#include <stdbool.h>

#include "settings.h"

/* Poles of the sampled loop: a rigid body, the control delay, the law without feed-forward and dead
 * band. True where no inertia is stated; a loop without feedback is stable. */
bool feedback_stable(const struct fd_gain_bank *gains, const struct axis_settings *axis,
                     uint32_t control_delay_ns);

#endif
