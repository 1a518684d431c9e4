#include "drive.h"

#include <math.h>
#include <string.h>

#include "numbers.h"
#include "port.h"

#define REST_SAMPLES 20u

static struct controller controllers[FD_AXES];
static struct fd_gain_bank gains[FD_AXES];
static int32_t history[REST_SAMPLES][FD_AXES];
static uint32_t latched; /* samples since power-up, saturating at REST_SAMPLES */
static uint32_t newest;
static float rad_per_count;
static bool powered;

void drive_init(void)
{
    const uint32_t counts = port_settings()->counts_per_turn;
    rad_per_count = counts > 0 ? TWO_PI / (float)counts : 0.0f; /* the self-test tells of it */
    memset(history, 0, sizeof history);
    latched = newest = 0;
    drive_power_off();
}

void drive_set_gains(const struct fd_gain_bank exchanged[FD_AXES])
{
    memcpy(gains, exchanged, sizeof gains);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        controller_exchange(&controllers[axis], history[newest][axis], rad_per_count);
    }
}

void drive_power_on(void)
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        controller_reset(&controllers[axis], history[newest][axis], rad_per_count);
    }
    powered = true;
}

void drive_power_off(void)
{
    static const int16_t none[FD_AXES];
    powered = false;
    port_write_effort(none); /* at once: what this sample has commanded is not in force yet */
    port_release_brake(false);
}

bool drive_powered(void)
{
    return powered;
}

static float effort_nm(unsigned axis, const struct setpoint setpoints[FD_AXES], int32_t position,
                       bool *finite)
{
    return controller_effort_nm(&controllers[axis], &gains[axis], &setpoints[axis],
                                &setpoints[OTHER_AXIS(axis)], position, rad_per_count,
                                port_settings()->axis[axis].effort_nm, finite);
}

/* Saturating: an encoder that wraps around must not make the axis seem near its reference. */
static int32_t following_error(const struct setpoint *setpoint, int32_t position)
{
    const int64_t reference = to_int32(setpoint->position_rad / rad_per_count);
    const int64_t error = reference - position;
    return (int32_t)(error > INT32_MAX ? INT32_MAX : error < -INT32_MAX ? -INT32_MAX : error);
}

void drive_latch(struct drive_sample *sample)
{
    port_read_encoders(sample->position);
}

void drive_latched(struct drive_sample *sample)
{
    memcpy(sample->position, history[newest], sizeof sample->position);
}

void drive_consider(const struct fd_gain_bank offered[FD_AXES],
                    const struct setpoint setpoints[FD_AXES], const struct drive_sample *sample,
                    bool moving, struct transfer *transfer)
{
    const float limit_nm[FD_AXES] = {
        port_settings()->axis[0].effort_nm, port_settings()->axis[1].effort_nm};
    const struct transfer_from from = {
        controllers, gains, setpoints, sample->position, limit_nm, rad_per_count, moving};
    transfer_consider(transfer, offered, &from);
}

void drive_take_over(const struct fd_gain_bank taken[FD_AXES], const struct transfer *transfer)
{
    memcpy(gains, taken, sizeof gains);
    memcpy(controllers, transfer->controllers, sizeof controllers);
}

bool drive_take_sample(const struct setpoint setpoints[FD_AXES], struct drive_sample *sample)
{
    float efforts_nm[FD_AXES] = {0.0f};
    bool finite = true;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        sample->following_error[axis] =
            following_error(&setpoints[axis], sample->position[axis]);
        if (powered) {
            efforts_nm[axis] = effort_nm(axis, setpoints, sample->position[axis], &finite);
        }
    }
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const float counts = efforts_nm[axis] / port_settings()->effort_per_count_nm;
        sample->effort[axis] = finite ? to_int16(counts) : 0;
        sample->feedback[axis] = (float)sample->effort[axis]
            - controllers[axis].feedforward_nm / port_settings()->effort_per_count_nm;
    }
    port_write_effort(sample->effort);
    port_release_brake(powered);
    newest = (newest + 1u) % REST_SAMPLES;
    memcpy(history[newest], sample->position, sizeof history[newest]);
    latched += latched < REST_SAMPLES;
    return finite;
}

const struct law_memory *drive_memory(unsigned axis)
{
    return &controllers[axis].memory;
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
    const int32_t way = counts_between(history[newest][axis], history[oldest][axis]);
    return (float)way * rad_per_count / ((float)(latched - 1u) * SAMPLE_PERIOD_S);
}

/* How far the axis strayed over the last 50 ms. */
static uint32_t span_counts(unsigned axis)
{
    int32_t lowest = 0, highest = 0; /* from the newest on, so that the counter may wrap */
    for (unsigned n = 0; n < REST_SAMPLES; n++) {
        const int32_t way = counts_between(history[n][axis], history[newest][axis]);
        lowest = way < lowest ? way : lowest;
        highest = way > highest ? way : highest;
    }
    return (uint32_t)highest - (uint32_t)lowest;
}

bool drive_at_rest(void)
{
    bool resting = latched == REST_SAMPLES;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        resting = resting && span_counts(axis) <= REST_COUNTS;
    }
    return resting;
}

float drive_rad_per_count(void)
{
    return rad_per_count;
}
