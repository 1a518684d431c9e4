/* Limits and first gains of an axis of the drives that are simulated here, and their plants. */
#ifndef DEFAULT_SETTINGS_H
#define DEFAULT_SETTINGS_H

#include "../settings.h"
#include "plant.h"

#define EFFORT_PER_COUNT_NM 0.004
#define COUNTS_PER_TURN 8400

extern const struct axis_settings default_axis;
extern const struct plant default_plants[FD_AXES];

#endif
