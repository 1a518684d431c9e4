#include "controller.h"

#include "numbers.h"
#include "settings.h"

void controller_reset(struct controller *controller, int32_t counts, float rad_per_count)
{
    controller->last_counts = counts;
    controller->velocity_rad_s = 0.0f;
    controller->integral_nm = 0.0f;
    controller_exchange(controller, counts, rad_per_count);
}

void controller_exchange(struct controller *controller, int32_t counts, float rad_per_count)
{
    law_reset(&controller->memory, (float)counts * rad_per_count);
}

float controller_effort_nm(struct controller *controller, const struct fd_gain_bank *gains,
                           const struct setpoint *setpoint, const struct setpoint *other,
                           int32_t counts, float rad_per_count, float limit_nm, bool *finite)
{
    /* differences in counts: exact, however far the axis is from zero */
    const float difference = (float)counts_between(counts, controller->last_counts)
        * rad_per_count / SAMPLE_PERIOD_S;
    controller->last_counts = counts;
    controller->velocity_rad_s += SAMPLE_PERIOD_S / (gains->velocity_filter + SAMPLE_PERIOD_S)
        * (difference - controller->velocity_rad_s);
    law_step(&controller->memory, gains, setpoint->position_rad);
    const float error = setpoint->position_rad + controller->memory.backlash_rad
        - (float)counts * rad_per_count;
    controller->integral_nm = clamped(
        controller->integral_nm + gains->integral * error * SAMPLE_PERIOD_S, limit_nm, finite);
    const float effort = gains->proportional * error
        + gains->derivative * (setpoint->velocity_rad_s - controller->velocity_rad_s)
        + controller->integral_nm
        + law_feedforward_nm(gains, setpoint, other, &controller->memory);
    return clamped(law_output_nm(gains, effort), limit_nm, finite);
}
