#include "controller.h"

#include <math.h>

#include "numbers.h"
#include "settings.h"

#define NOTHING_CARRIED_NM 1e-6f /* what is left of a jump counts no longer */

void controller_reset(struct controller *controller, int32_t counts, float rad_per_count)
{
    controller->last_counts = counts;
    controller->velocity_rad_s = 0.0f;
    controller->integral_nm = 0.0f;
    controller->carried_nm = 0.0f;
    controller->feedforward_nm = 0.0f;
    controller_exchange(controller, counts, rad_per_count);
}

void controller_exchange(struct controller *controller, int32_t counts, float rad_per_count)
{
    law_reset(&controller->memory, (float)counts * rad_per_count);
}

void controller_observe(struct controller *controller, const struct fd_gain_bank *gains,
                        float reference_rad, int32_t counts, float rad_per_count)
{
    /* differences in counts: exact, however far the axis is from zero */
    const float difference = (float)counts_between(counts, controller->last_counts)
        * rad_per_count / SAMPLE_PERIOD_S;
    controller->last_counts = counts;
    controller->velocity_rad_s += SAMPLE_PERIOD_S / (gains->velocity_filter + SAMPLE_PERIOD_S)
        * (difference - controller->velocity_rad_s);
    law_step(&controller->memory, gains, reference_rad);
}

float controller_law_nm(struct controller *controller, const struct fd_gain_bank *gains,
                        const struct setpoint *setpoint, const struct setpoint *other,
                        int32_t counts, float rad_per_count, float limit_nm, bool *finite)
{
    controller_observe(controller, gains, setpoint->position_rad, counts, rad_per_count);
    const float error = setpoint->position_rad + controller->memory.backlash_rad
        - (float)counts * rad_per_count;
    controller->integral_nm = clamped(
        controller->integral_nm + gains->integral * error * SAMPLE_PERIOD_S, limit_nm, finite);
    const float feedforward = law_feedforward_nm(gains, setpoint, other, &controller->memory);
    const float effort = gains->proportional * error
        + gains->derivative * (setpoint->velocity_rad_s - controller->velocity_rad_s)
        + controller->integral_nm + feedforward;
    controller->feedforward_nm = clamped(feedforward, limit_nm, finite);
    return law_output_nm(gains, effort);
}

float controller_effort_nm(struct controller *controller, const struct fd_gain_bank *gains,
                           const struct setpoint *setpoint, const struct setpoint *other,
                           int32_t counts, float rad_per_count, float limit_nm, bool *finite)
{
    const float law = controller_law_nm(controller, gains, setpoint, other, counts, rad_per_count,
                                        limit_nm, finite);
    const float effort = clamped(law + controller->carried_nm, limit_nm, finite);
    const bool carried = fabsf(controller->carried_nm) > NOTHING_CARRIED_NM;
    controller->carried_nm = carried ? CARRY_LEFT * controller->carried_nm : 0.0f;
    return effort;
}
