#include "drive.h"

#include <math.h>
#include <string.h>

#include "port.h"

#define REST_SAMPLES 20u
#define REST_COUNTS 2

static struct controller controllers[FD_AXES];
static struct fd_gain_bank gains[FD_AXES];
static int32_t history[REST_SAMPLES][FD_AXES];
static uint32_t latched; /* samples since power-up, saturating at REST_SAMPLES */
static uint32_t newest;
static float rad_per_count;
static bool powered;

void drive_init(void)
{
    rad_per_count = TWO_PI / (float)port_settings()->counts_per_turn;
    latched = newest = 0;
    powered = false;
}

void drive_set_gains(const struct fd_gain_bank exchanged[FD_AXES])
{
    memcpy(gains, exchanged, sizeof gains);
}

void drive_power_on(void)
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        controller_reset(&controllers[axis], history[newest][axis]);
    }
    powered = true;
}

void drive_power_off(void)
{
    powered = false;
}

bool drive_powered(void)
{
    return powered;
}

static int16_t effort_counts(unsigned axis, const struct setpoint *setpoint, int32_t position)
{
    const struct board_settings *settings = port_settings();
    const float effort_nm =
        controller_effort_nm(&controllers[axis], &gains[axis], setpoint, position, rad_per_count,
                             settings->axis[axis].effort_nm);
    return (int16_t)lrintf(effort_nm / settings->effort_per_count_nm);
}

void drive_take_sample(const struct setpoint setpoints[FD_AXES], struct drive_sample *sample)
{
    port_read_encoders(sample->position);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const int32_t position = sample->position[axis];
        const long reference = lrintf(setpoints[axis].position_rad / rad_per_count);
        sample->following_error[axis] = (int32_t)reference - position;
        sample->effort[axis] = powered ? effort_counts(axis, &setpoints[axis], position) : 0;
    }
    port_write_effort(sample->effort);
    newest = (newest + 1u) % REST_SAMPLES;
    memcpy(history[newest], sample->position, sizeof history[newest]);
    latched += latched < REST_SAMPLES;
}

float drive_position_rad(unsigned axis)
{
    return (float)history[newest][axis] * rad_per_count;
}

float drive_speed_rad_s(unsigned axis)
{
    if (latched < 2u) {
        return 0.0f;
    }
    const uint32_t oldest = (newest + REST_SAMPLES - (latched - 1u)) % REST_SAMPLES;
    const int32_t way = history[newest][axis] - history[oldest][axis];
    return (float)way * rad_per_count / ((float)(latched - 1u) * SAMPLE_PERIOD_S);
}

bool drive_at_rest(void)
{
    if (latched < REST_SAMPLES) {
        return false;
    }
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        int32_t lowest = history[0][axis], highest = history[0][axis];
        for (unsigned n = 1; n < REST_SAMPLES; n++) {
            lowest = history[n][axis] < lowest ? history[n][axis] : lowest;
            highest = history[n][axis] > highest ? history[n][axis] : highest;
        }
        if (highest - lowest > REST_COUNTS) {
            return false;
        }
    }
    return true;
}

float drive_rad_per_count(void)
{
    return rad_per_count;
}
