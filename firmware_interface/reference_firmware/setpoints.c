#include "setpoints.h"

#include <math.h>
#include <string.h>

#include "drive.h"
#include "numbers.h"
#include "settings.h"
#include "stop.h"

static enum { HOLD, FOLLOW, STOP } mode;
static struct setpoint current[FD_AXES];
static struct trajectory followed;
static struct setpoint stop_from[FD_AXES];
static uint32_t stop_samples, stop_sample;

/* Without velocity, at the positions that stand in `current`. */
static void hold(void)
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        current[axis].velocity_rad_s = 0.0f;
        current[axis].acceleration_rad_s2 = 0.0f;
    }
    mode = HOLD;
}

void setpoints_init(void)
{
    memset(current, 0, sizeof current);
    mode = HOLD;
}

void setpoints_hold_here(void)
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        current[axis].position_rad = drive_position_rad(axis);
    }
    hold();
}

void setpoints_follow(const struct trajectory *trajectory)
{
    followed = *trajectory;
    trajectory_begin(&followed, current);
    mode = FOLLOW;
}

/* From the present setpoints. */
static void begin_stop(void)
{
    memcpy(stop_from, current, sizeof stop_from);
    stop_samples = (uint32_t)to_int32(stop_duration_s(current) / SAMPLE_PERIOD_S);
    stop_sample = 0;
    mode = STOP;
}

void setpoints_stop(void)
{
    if (mode != FOLLOW) {
        return; /* a ramp that begins anew in the middle is up to a third longer */
    }
    begin_stop();
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        stop_from[axis].acceleration_rad_s2 = 0.0f;
    }
}

void setpoints_take_up(const struct setpoint setpoints[FD_AXES], bool moving)
{
    memcpy(current, setpoints, sizeof current);
    if (moving) {
        begin_stop();
    } else {
        hold();
    }
}

float setpoints_rest_rad(const struct setpoint setpoints[FD_AXES], unsigned axis)
{
    return stop_setpoint(&setpoints[axis], stop_duration_s(setpoints), 1.0f).position_rad;
}

static void advance_stop(void)
{
    const float duration_s = (float)stop_samples * SAMPLE_PERIOD_S;
    const float share = (float)stop_sample / (float)stop_samples;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        current[axis] = stop_setpoint(&stop_from[axis], duration_s, share);
    }
}

const struct setpoint *setpoints_advance(void)
{
    if (mode == FOLLOW) {
        trajectory_next(&followed, current);
    } else if (mode == STOP && stop_sample == stop_samples) {
        hold();
    } else if (mode == STOP) {
        stop_sample++;
        advance_stop();
    }
    return current;
}

const struct setpoint *setpoints_current(void)
{
    return current;
}

bool setpoints_moving(void)
{
    return mode != HOLD;
}

bool setpoints_finite(void)
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        if (!isfinite(current[axis].position_rad) || !isfinite(current[axis].velocity_rad_s)
            || !isfinite(current[axis].acceleration_rad_s2)) {
            return false;
        }
    }
    return true;
}
