/* How a stop goes: the velocity falls along a cubic with a level end. [both] */
#ifndef STOP_H
#define STOP_H

#include "control_law.h"

/* Time in which a stop brings axes of this speed to rest. */
float stop_duration_s(const struct setpoint setpoints[FD_AXES]);

/* As much of an acceleration as a stop can begin with: it brakes, and does not turn round. */
float stop_acceleration_rad_s2(float velocity_rad_s, float acceleration_rad_s2, float duration_s);

/* The setpoint when this share of a stop's duration is over. */
struct setpoint stop_setpoint(const struct setpoint *from, float duration_s, float share);

#endif
