#include "trajectory.h"

#include <math.h>
#include <string.h>

#include "crc.h"
#include "register_file.h"
#include "settings.h"

#define AXIS_STRIDE (FD_REG_TRAJECTORY_Z_COMPONENTS - FD_REG_TRAJECTORY_X_COMPONENTS)
#define TABLE_END (FD_REG_TRAJECTORY_Z_ACCELERATION + 2u)
#define TURN 18446744073709551616.0 /* 2^64 */
#define PI 3.141592653589793

/* ---- out of the registers */

uint32_t trajectory_crc(void)
{
    return crc32_of_words(register_words(FD_REG_TRAJECTORY_KIND),
                          TABLE_END - FD_REG_TRAJECTORY_KIND);
}

static float entry_f32(uint16_t base, uint16_t axis, uint16_t n)
{
    return register_f32((uint16_t)(base + axis * AXIS_STRIDE + 2u * n));
}

/* An angle as 2^-64 turns. Double precision, and slow for it, but only once per motion. */
static uint64_t turns(double angle_rad)
{
    double share = angle_rad / (2.0 * PI);
    share -= floor(share);
    return share < 1.0 ? (uint64_t)(share * TURN) : 0;
}

/* Half a turn a sample and more would be another motion, seen at the samples; a NaN is none. */
static bool slower_than_sampling(float rate_rad_s)
{
    return fabs((double)rate_rad_s) * (SAMPLE_PERIOD_NS * 1e-9) < PI;
}

static bool read_sines(struct axis_motion *motion, uint16_t axis, uint32_t lead_in_samples)
{
    motion->components = register_u16(
        (uint16_t)(FD_REG_TRAJECTORY_X_COMPONENTS + axis * AXIS_STRIDE));
    for (uint16_t n = 0; n < motion->components; n++) {
        struct sine *sine = &motion->sines[n];
        const float phase_rad = entry_f32(FD_REG_TRAJECTORY_X_PHASE, axis, n);
        sine->amplitude_rad = entry_f32(FD_REG_TRAJECTORY_X_AMPLITUDE, axis, n);
        sine->rate_rad_s = entry_f32(FD_REG_TRAJECTORY_X_ANGULAR_FREQUENCY, axis, n);
        if (!isfinite(sine->amplitude_rad) || !isfinite(phase_rad)
            || !slower_than_sampling(sine->rate_rad_s)) {
            return false;
        }
        sine->step = turns((double)sine->rate_rad_s * (SAMPLE_PERIOD_NS * 1e-9));
        sine->phase = turns((double)phase_rad) - sine->step * lead_in_samples;
    }
    return motion->components > 0;
}

static bool read_stairs(struct staircase *stairs, uint16_t axis, uint32_t lead_in_samples)
{
    stairs->levels =
        register_u16((uint16_t)(FD_REG_TRAJECTORY_X_LEVELS + axis * AXIS_STRIDE));
    stairs->dwell_s = entry_f32(FD_REG_TRAJECTORY_X_DWELL, axis, 0);
    stairs->acceleration_rad_s2 = entry_f32(FD_REG_TRAJECTORY_X_ACCELERATION, axis, 0);
    stairs->late_s = -(float)lead_in_samples * SAMPLE_PERIOD_S; /* the first speed holds before */
    for (uint16_t n = 0; n < stairs->levels; n++) {
        stairs->speed_rad_s[n] = entry_f32(FD_REG_TRAJECTORY_X_LEVEL_SPEED, axis, n);
        if (!isfinite(stairs->speed_rad_s[n])) {
            return false;
        }
    }
    return stairs->levels > 0 && isfinite(stairs->dwell_s) && stairs->dwell_s >= 0.0f
        && isfinite(stairs->acceleration_rad_s2) && stairs->acceleration_rad_s2 > 0.0f;
}

bool trajectory_read(struct trajectory *trajectory)
{
    memset(trajectory, 0, sizeof *trajectory);
    trajectory->kind = register_u16(FD_REG_TRAJECTORY_KIND);
    trajectory->lead_in_samples = register_u32(FD_REG_TRAJECTORY_LEAD_IN_SAMPLES);
    trajectory->capture_samples = register_u32(FD_REG_TRAJECTORY_CAPTURE_SAMPLES);
    if (trajectory->lead_in_samples == 0 || trajectory->capture_samples == 0) {
        return false; /* never written */
    }
    for (uint16_t axis = 0; axis < FD_AXES; axis++) {
        struct axis_motion *motion = &trajectory->axis[axis];
        bool complete = false;
        if (trajectory->kind == FD_TRAJECTORYKIND_MULTISINE) {
            complete = read_sines(motion, axis, trajectory->lead_in_samples);
        } else if (trajectory->kind == FD_TRAJECTORYKIND_STAIRCASE) {
            complete = read_stairs(&motion->stairs, axis, trajectory->lead_in_samples);
        }
        if (!complete) {
            return false;
        }
    }
    return true;
}

/* ---- sample by sample */

void trajectory_begin(struct trajectory *trajectory, const struct setpoint rest[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        trajectory->axis[axis].rest_rad = rest[axis].position_rad;
    }
}

/* Sum of sines, and on to the next sample. */
static struct setpoint next_of_sines(struct axis_motion *motion)
{
    struct setpoint full = {-motion->rest_rad, 0.0f, 0.0f};
    for (unsigned n = 0; n < motion->components; n++) {
        struct sine *sine = &motion->sines[n];
        /* as signed, half a turn each way: where sinf is quick and exact */
        const int32_t turn = (int32_t)(uint32_t)(sine->phase >> 32);
        const float angle = (float)turn * (TWO_PI / 4294967296.0f);
        const float in_phase = sine->amplitude_rad * sinf(angle);
        const float rate = sine->rate_rad_s;
        full.position_rad += in_phase;
        full.velocity_rad_s += rate * sine->amplitude_rad * cosf(angle);
        full.acceleration_rad_s2 -= rate * rate * in_phase;
        sine->phase += sine->step;
    }
    return full;
}

/* Speed at the beginning of a segment, its acceleration and its length. */
static float segment(const struct staircase *stairs, float *acceleration, float *duration_s)
{
    const float speed = stairs->speed_rad_s[stairs->segment / 2u];
    *acceleration = 0.0f;
    *duration_s = stairs->dwell_s;
    if (stairs->segment % 2u == 1u) {
        const float change = stairs->speed_rad_s[stairs->segment / 2u + 1u] - speed;
        *acceleration = copysignf(stairs->acceleration_rad_s2, change);
        *duration_s = fabsf(change) / stairs->acceleration_rad_s2;
    }
    return speed;
}

/* Constant accelerations, one after the other, and on to the next sample. */
static struct setpoint next_of_stairs(struct staircase *stairs)
{
    float acceleration, duration_s;
    float speed = segment(stairs, &acceleration, &duration_s);
    float since_s = stairs->late_s + (float)stairs->samples * SAMPLE_PERIOD_S;
    while (stairs->segment < 2u * stairs->levels && since_s >= duration_s) {
        stairs->start_rad += (speed + 0.5f * acceleration * duration_s) * duration_s;
        stairs->late_s = since_s -= duration_s;
        stairs->samples = 0;
        stairs->segment++;
        speed = segment(stairs, &acceleration, &duration_s);
    }
    stairs->samples++;
    const struct setpoint full = {
        stairs->start_rad + (speed + 0.5f * acceleration * since_s) * since_s,
        speed + acceleration * since_s,
        acceleration,
    };
    return full;
}

/* The lead-in's envelope over the motion, given from the rest position. */
static struct setpoint blended(struct setpoint full, float share, float lead_in_s)
{
    const float rest_of = 1.0f - share;
    const float blend = share * share * share * (10.0f - 15.0f * share + 6.0f * share * share);
    const float rate = 30.0f * (share * rest_of) * (share * rest_of) / lead_in_s;
    const float curvature =
        60.0f * share * rest_of * (1.0f - 2.0f * share) / (lead_in_s * lead_in_s);
    const struct setpoint mixed = {
        blend * full.position_rad,
        blend * full.velocity_rad_s + rate * full.position_rad,
        blend * full.acceleration_rad_s2 + 2.0f * rate * full.velocity_rad_s
            + curvature * full.position_rad,
    };
    return mixed;
}

void trajectory_next(struct trajectory *trajectory, struct setpoint setpoints[FD_AXES])
{
    const float lead_in = (float)trajectory->lead_in_samples;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        struct axis_motion *motion = &trajectory->axis[axis];
        struct setpoint next = trajectory->kind == FD_TRAJECTORYKIND_STAIRCASE
            ? next_of_stairs(&motion->stairs)
            : next_of_sines(motion);
        if (trajectory->sample < trajectory->lead_in_samples) {
            next = blended(next, (float)trajectory->sample / lead_in, lead_in * SAMPLE_PERIOD_S);
        }
        next.position_rad += motion->rest_rad;
        setpoints[axis] = next;
    }
    trajectory->sample++;
}
