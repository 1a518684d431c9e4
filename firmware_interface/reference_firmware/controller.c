#include "controller.h"

#include <math.h>

#include "numbers.h"
#include "settings.h"

#define RIPPLES (sizeof((struct fd_gain_bank *)0)->ripple_sine / sizeof(float))

static float ripple_nm(const struct fd_gain_bank *gains, float position_rad)
{
    float effort = 0.0f;
    for (unsigned k = 0; k < RIPPLES; k++) {
        const float cosine = gains->ripple_cosine[k], sine = gains->ripple_sine[k];
        if (fabsf(cosine) + fabsf(sine) > 0.0f) { /* off, mostly: saves the time */
            const float period = gains->ripple_period[k];
            const float angle = TWO_PI * fmodf(position_rad, period) / period;
            effort += cosine * cosf(angle) + sine * sinf(angle);
        }
    }
    return effort;
}

float controller_feedforward_nm(const struct fd_gain_bank *gains, const struct setpoint *setpoint)
{
    const float velocity = setpoint->velocity_rad_s;
    const float share = velocity / gains->stribeck_speed;
    const float friction =
        gains->coulomb_feedforward + gains->stribeck_feedforward * expf(-share * share);
    return gains->inertia_feedforward * setpoint->acceleration_rad_s2
        + gains->viscous_feedforward * velocity
        + gains->viscous_difference_feedforward * fabsf(velocity)
        + friction * tanhf(velocity / gains->coulomb_smoothing)
        + gains->offset_feedforward
        + ripple_nm(gains, setpoint->position_rad);
}

void controller_reset(struct controller *controller, int32_t counts)
{
    controller->last_counts = counts;
    controller->velocity_rad_s = 0.0f;
    controller->integral_nm = 0.0f;
}

float controller_effort_nm(struct controller *controller, const struct fd_gain_bank *gains,
                           const struct setpoint *setpoint, int32_t counts, float rad_per_count,
                           float limit_nm, bool *finite)
{
    /* differences in counts: exact, however far the axis is from zero */
    const float difference = (float)counts_between(counts, controller->last_counts)
        * rad_per_count / SAMPLE_PERIOD_S;
    controller->last_counts = counts;
    controller->velocity_rad_s += SAMPLE_PERIOD_S / (gains->velocity_filter + SAMPLE_PERIOD_S)
        * (difference - controller->velocity_rad_s);
    const float error = setpoint->position_rad - (float)counts * rad_per_count;
    controller->integral_nm = clamped(
        controller->integral_nm + gains->integral * error * SAMPLE_PERIOD_S, limit_nm, finite);
    const float effort = gains->proportional * error
        + gains->derivative * (setpoint->velocity_rad_s - controller->velocity_rad_s)
        + controller->integral_nm
        + controller_feedforward_nm(gains, setpoint);
    return clamped(effort, limit_nm, finite);
}
