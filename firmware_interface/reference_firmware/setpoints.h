/* Where the axes should be: holding, following the trajectory, or coming to rest.
 * Advanced by the sample interrupt; in the main loop, hold the lock. */
#ifndef SETPOINTS_H
#define SETPOINTS_H

#include "trajectory.h"

/* Before the first sample: hold position zero. */
void setpoints_init(void);

/* Stay where the drive stands. */
void setpoints_hold_here(void);

/* Start a trajectory from the present setpoints. */
void setpoints_follow(const struct trajectory *trajectory);

/* Decelerate to rest from the present setpoints; one stop is enough: a second changes nothing. */
void setpoints_stop(void);

/* Be here now, and come to rest from there or, unless moving, stay. */
void setpoints_take_up(const struct setpoint setpoints[FD_AXES], bool moving);

/* Where a stop of an axis from these setpoints ends. */
float setpoints_rest_rad(const struct setpoint setpoints[FD_AXES], unsigned axis);

/* The setpoints of the next sample. */
const struct setpoint *setpoints_advance(void);

/* The last ones given, by axis. */
const struct setpoint *setpoints_current(void);

/* They are not constant. */
bool setpoints_moving(void);

/* Each is a finite number. */
bool setpoints_finite(void);

#endif
