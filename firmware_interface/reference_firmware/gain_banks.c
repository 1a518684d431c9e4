#include "gain_banks.h"

#include <math.h>
#include <string.h>

#include "port.h"
#include "register_file.h"

#define BANK_FLOATS (sizeof(struct fd_gain_bank) / sizeof(float))

static struct fd_gain_bank active[FD_AXES], previous[FD_AXES];
static bool unconfirmed, staged_crc_ok;
static uint32_t committed_us;

static void put_active(const struct fd_gain_bank gains[FD_AXES])
{
    memcpy(active, gains, sizeof active);
    register_put_gains(GAINS_ACTIVE, active);
    register_put_u32(FD_REG_ACTIVE_CRC, register_gains_crc(GAINS_ACTIVE));
}

void gain_banks_init(const struct fd_gain_bank gains[FD_AXES])
{
    unconfirmed = staged_crc_ok = false;
    put_active(gains);
}

const struct fd_gain_bank *gain_banks_active(void)
{
    return active;
}

void gain_banks_check_staged(void)
{
    staged_crc_ok = register_gains_crc(GAINS_SHADOW) == register_u32(FD_REG_SHADOW_CRC);
}

bool gain_banks_staged_crc_ok(void)
{
    return staged_crc_ok;
}

bool gain_banks_unconfirmed(void)
{
    return unconfirmed;
}

uint32_t gain_banks_remaining_us(void)
{
    const uint32_t passed_us = port_time_us() - committed_us;
    const uint32_t window_us = port_settings()->confirm_window_us;
    return unconfirmed && passed_us < window_us ? window_us - passed_us : 0;
}

/* Numbers that may be negative, and numbers that divide and so may not be zero: marked with 1. */
#define ONES_4 {1.0f, 1.0f, 1.0f, 1.0f}
#define ONES_12 {1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f}
#define ONES_24 \
    {1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, \
     1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f}
static const struct fd_gain_bank may_be_negative = {
    .offset_feedforward = 1.0f,
    .viscous_difference_feedforward = 1.0f,
    .ripple_cosine = ONES_4,
    .ripple_sine = ONES_4,
    .friction_forward = ONES_12,
    .friction_backward = ONES_12,
    .table_start = 1.0f,
    .load_table = ONES_24,
    .local_friction_table = ONES_24,
    .cross_inertia_feedforward = 1.0f,
    .cross_viscous_feedforward = 1.0f,
    .cross_coulomb_feedforward = 1.0f,
};
static const struct fd_gain_bank must_be_positive = {
    .coulomb_smoothing = 1.0f,
    .stribeck_speed = 1.0f,
    .ripple_period = ONES_4,
    .friction_top_speed = 1.0f,
    .table_step = 1.0f,
    .presliding_distance = 1.0f,
    .backlash_distance = 1.0f,
    .deadband_smoothing = 1.0f,
};

const struct fd_gain_bank *gain_banks_off(void)
{
    return &must_be_positive;
}

/* A bank is a row of floats. */
static float number_of(const struct fd_gain_bank *gains, unsigned n)
{
    float number;
    memcpy(&number, (const unsigned char *)gains + n * sizeof number, sizeof number);
    return number;
}

/* Whether number n may stand where its largest value is this; a NaN may nowhere. */
static bool allowed(unsigned n, float number, float maximum)
{
    return isfinite(number) && fabsf(number) <= maximum
        && (number >= 0.0f || number_of(&may_be_negative, n) > 0.0f)
        && (number > 0.0f || !(number_of(&must_be_positive, n) > 0.0f));
}

bool gain_banks_within_maxima(const struct fd_gain_bank gains[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const struct fd_gain_bank *maxima = &port_settings()->axis[axis].gain_maximum;
        for (unsigned n = 0; n < BANK_FLOATS; n++) {
            if (!allowed(n, number_of(&gains[axis], n), number_of(maxima, n))) {
                return false;
            }
        }
    }
    return true;
}

static bool within_step(const struct fd_gain_bank staged[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const struct axis_settings *settings = &port_settings()->axis[axis];
        for (unsigned n = 0; n < BANK_FLOATS; n++) {
            const float change = fabsf(number_of(&staged[axis], n) - number_of(&active[axis], n));
            if (!(change <= settings->gain_step * number_of(&settings->gain_maximum, n))) {
                return false;
            }
        }
    }
    return true;
}

enum fd_result gain_banks_staged(uint32_t crc, struct fd_gain_bank staged[FD_AXES])
{
    if (unconfirmed) {
        return FD_RESULT_UNCONFIRMED;
    }
    if (!staged_crc_ok || register_u32(FD_REG_SHADOW_CRC) != crc) {
        return FD_RESULT_GAIN_CRC;
    }
    register_take_gains(GAINS_SHADOW, staged);
    if (!gain_banks_within_maxima(staged) || !within_step(staged)) {
        return FD_RESULT_GAIN_LIMITS;
    }
    return FD_RESULT_DONE;
}

void gain_banks_commit(const struct fd_gain_bank staged[FD_AXES])
{
    memcpy(previous, active, sizeof previous);
    put_active(staged);
    unconfirmed = true;
    committed_us = port_time_us();
}

enum fd_result gain_banks_confirm(void)
{
    if (!unconfirmed) {
        return FD_RESULT_NOTHING_COMMITTED;
    }
    unconfirmed = false;
    return FD_RESULT_DONE;
}

enum fd_result gain_banks_roll_back(void)
{
    if (!unconfirmed) {
        return FD_RESULT_NOTHING_COMMITTED;
    }
    put_active(previous);
    unconfirmed = false;
    return FD_RESULT_DONE;
}
