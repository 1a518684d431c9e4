#include "control_law.h"

#include <math.h>
#include <stdbool.h>

#include "settings.h"

#define ENTRIES(table) (sizeof((struct fd_gain_bank *)0)->table / sizeof(float))
#define RIPPLES ENTRIES(ripple_sine)

/* Terms that are off cost no more than this. */
static bool on(float number)
{
    return fabsf(number) > 0.0f;
}

/* ---- memory */

void law_reset(struct law_memory *memory, float reference_rad)
{
    memory->reference_rad = reference_rad;
    memory->presliding = memory->backlash_rad = 0.0f;
}

void law_keep(struct law_memory *memory, const struct fd_gain_bank *gains)
{
    memory->presliding = on(gains->presliding_feedforward) ? memory->presliding : 0.0f;
    memory->backlash_rad = on(gains->backlash_offset) ? memory->backlash_rad : 0.0f;
}

void law_step(struct law_memory *memory, const struct fd_gain_bank *gains, float reference_rad)
{
    const float step = reference_rad - memory->reference_rad;
    const float sign = copysignf(1.0f, step), way = fabsf(step);
    memory->reference_rad = reference_rad;
    /* expm1f, not expf: a step is so small that 1 less its exponential would be all rounding */
    if (on(gains->presliding_feedforward)) {
        memory->presliding -=
            (sign - memory->presliding) * expm1f(-way / gains->presliding_distance);
    }
    if (on(gains->backlash_offset)) {
        memory->backlash_rad -= (sign * gains->backlash_offset - memory->backlash_rad)
            * expm1f(-way / gains->backlash_distance);
    }
}

/* ---- tables */

static float entry(const float table[], unsigned count, int n)
{
    return n >= 0 && n < (int)count ? table[n] : 0.0f;
}

/* Linear between the entries; falls to zero over one cell beyond the ends. */
static float interpolated(const float table[], unsigned count, float at)
{
    const float inside = fminf(fmaxf(at, -1.0f), (float)count), cell = floorf(inside);
    const float share = inside - cell;
    return (1.0f - share) * entry(table, count, (int)cell)
        + share * entry(table, count, (int)cell + 1);
}

/* What is left of a term that fades out beyond a speed; 0 means never. */
static float faded(float speed, float fade_speed)
{
    return on(fade_speed) ? fminf(fmaxf(2.0f - speed / fade_speed, 0.0f), 1.0f) : 1.0f;
}

static float ripple_nm(const struct fd_gain_bank *gains, float position_rad, float speed)
{
    float effort = 0.0f;
    for (unsigned k = 0; k < RIPPLES; k++) {
        const float cosine = gains->ripple_cosine[k], sine = gains->ripple_sine[k];
        if (on(cosine) || on(sine)) {
            const float period = gains->ripple_period[k];
            const float angle = TWO_PI * fmodf(position_rad, period) / period;
            effort += (cosine * cosf(angle) + sine * sinf(angle))
                * faded(speed, gains->ripple_fade_speed[k]);
        }
    }
    return effort;
}

static float tables_nm(const struct fd_gain_bank *gains, float position_rad, float speed,
                       float direction)
{
    const float at = (position_rad - gains->table_start) / gains->table_step;
    const float load = interpolated(gains->load_table, ENTRIES(load_table), at);
    const float friction =
        interpolated(gains->local_friction_table, ENTRIES(local_friction_table), at);
    return (load + friction * direction) * faded(speed, gains->table_fade_speed);
}

static float curve_nm(const struct fd_gain_bank *gains, float velocity)
{
    const float *curve = velocity > 0.0f ? gains->friction_forward : gains->friction_backward;
    const unsigned count = ENTRIES(friction_forward);
    const float share = fabsf(velocity) / gains->friction_top_speed;
    return interpolated(curve, count, (float)(count - 1u) * sqrtf(share));
}

/* ---- the other axis, and the transmission */

static float cross_nm(const struct fd_gain_bank *gains, const struct setpoint *other)
{
    const float velocity = other->velocity_rad_s;
    const float share = on(gains->cross_coulomb_feedforward)
        ? tanhf(velocity / gains->coulomb_smoothing) : 0.0f;
    return gains->cross_inertia_feedforward * other->acceleration_rad_s2
        + gains->cross_viscous_feedforward * velocity + gains->cross_coulomb_feedforward * share;
}

static float transmission_nm(const struct fd_gain_bank *gains, const struct setpoint *setpoint,
                             float direction)
{
    const float friction = gains->viscous_feedforward * setpoint->velocity_rad_s
        + gains->coulomb_feedforward * direction;
    const float passed = gains->transmitted_inertia * setpoint->acceleration_rad_s2
        + gains->offset_feedforward + gains->transmitted_friction * friction;
    const float lost = gains->transmission_loss * direction * copysignf(1.0f, passed);
    return passed / (1.0f - lost) - passed;
}

/* ---- in all */

static float friction_nm(const struct fd_gain_bank *gains, float velocity)
{
    const float share = velocity / gains->stribeck_speed;
    const float bump = on(gains->stribeck_feedforward)
        ? gains->stribeck_feedforward * expf(-share * share) : 0.0f;
    return gains->coulomb_feedforward + bump + curve_nm(gains, velocity);
}

float law_feedforward_nm(const struct fd_gain_bank *gains, const struct setpoint *setpoint,
                         const struct setpoint *other, const struct law_memory *memory)
{
    const float velocity = setpoint->velocity_rad_s, speed = fabsf(velocity);
    const float direction = tanhf(velocity / gains->coulomb_smoothing);
    const float followed = setpoint->position_rad + memory->backlash_rad;
    const float lost =
        on(gains->transmission_loss) ? transmission_nm(gains, setpoint, direction) : 0.0f;
    return gains->inertia_feedforward * setpoint->acceleration_rad_s2
        + gains->viscous_feedforward * velocity
        + gains->viscous_difference_feedforward * speed
        + friction_nm(gains, velocity) * direction
        + gains->offset_feedforward
        + ripple_nm(gains, followed, speed)
        + tables_nm(gains, followed, speed, direction)
        + gains->presliding_feedforward * memory->presliding
        + cross_nm(gains, other)
        + lost;
}

float law_output_nm(const struct fd_gain_bank *gains, float effort_nm)
{
    return on(gains->deadband_inverse)
        ? effort_nm + gains->deadband_inverse * tanhf(effort_nm / gains->deadband_smoothing)
        : effort_nm;
}
