#include "trajectory_check.h"

#include <math.h>
#include <string.h>

#include "port.h"
#include "stop.h"

/* two positions of some rad differ by as much as this share of a step, for rounding alone */
#define JUMP_MARGIN 1.01f

/* Whether the ramps between levels are allowed; one may be too short for any sample to fall on it,
 * so that the walk would not see it. Only with levels that differ there are ramps. */
static bool ramps_allowed(const struct trajectory *trajectory)
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const struct staircase *stairs = &trajectory->axis[axis].stairs;
        const float limit = port_settings()->axis[axis].acceleration_rad_s2;
        for (unsigned n = 0; n < stairs->levels; n++) {
            const float change = stairs->speed_rad_s[n + 1u] - stairs->speed_rad_s[n];
            if (fabsf(change) > 0.0f && !(stairs->acceleration_rad_s2 <= limit)) {
                return false;
            }
        }
    }
    return true;
}

void trajectory_check_begin(struct trajectory_check *check, const struct trajectory *trajectory,
                            const struct fd_gain_bank gains[FD_AXES],
                            const struct law_memory memory[FD_AXES])
{
    check->walk = *trajectory;
    memcpy(check->gains, gains, sizeof check->gains);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        check->memory[axis] = memory[axis];
        check->memory[axis].reference_rad = trajectory->axis[axis].rest_rad;
    }
    check->samples_left = trajectory->lead_in_samples + trajectory->capture_samples;
    check->allowed = ramps_allowed(trajectory);
}

/* Every comparison is written so that what is no number fails. */
static bool inside(const struct setpoint *setpoint, const struct axis_settings *limit)
{
    return fabsf(setpoint->position_rad) <= limit->travel_rad
        && fabsf(setpoint->velocity_rad_s) <= limit->speed_rad_s
        && fabsf(setpoint->acceleration_rad_s2) <= limit->acceleration_rad_s2;
}

/* Whether an axis could stop inside its travel: the way of a stop is half of that at full speed. */
static bool can_stop(const struct setpoint *setpoint, float stop_s, float travel_rad)
{
    return fabsf(setpoint->position_rad + setpoint->velocity_rad_s * stop_s / 2.0f) <= travel_rad;
}

/* The effort where the axis follows exactly. */
static float exact_effort_nm(const struct fd_gain_bank *gains, const struct setpoint *next,
                             const struct setpoint *other, struct law_memory *memory)
{
    law_step(memory, gains, next->position_rad);
    return law_output_nm(gains, law_feedforward_nm(gains, next, other, memory));
}

static bool next_allowed(struct trajectory_check *check)
{
    struct setpoint setpoints[FD_AXES];
    trajectory_next(&check->walk, setpoints);
    const float stop_s = stop_duration_s(setpoints);
    bool allowed = true;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const struct axis_settings *limit = &port_settings()->axis[axis];
        const struct setpoint *next = &setpoints[axis];
        struct law_memory *memory = &check->memory[axis];
        const float jump_rad = fabsf(next->position_rad - memory->reference_rad);
        const float effort_nm =
            exact_effort_nm(&check->gains[axis], next, &setpoints[OTHER_AXIS(axis)], memory);
        allowed = allowed && inside(next, limit) && can_stop(next, stop_s, limit->travel_rad)
            && jump_rad <= limit->speed_rad_s * SAMPLE_PERIOD_S * JUMP_MARGIN
            && fabsf(effort_nm) <= limit->effort_nm;
    }
    return allowed;
}

bool trajectory_check_go_on(struct trajectory_check *check, uint32_t samples)
{
    for (; samples > 0 && check->samples_left > 0 && check->allowed; samples--) {
        check->allowed = next_allowed(check);
        check->samples_left--;
    }
    return check->allowed;
}
