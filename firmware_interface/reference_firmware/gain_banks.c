#include "gain_banks.h"

#include <math.h>
#include <string.h>

#include "crc.h"
#include "port.h"
#include "register_file.h"

#define BANK_FLOATS (sizeof(struct fd_gain_bank) / sizeof(float))
#define ACTIVE_STRIDE (FD_REG_ACTIVE_Z_PROPORTIONAL - FD_REG_ACTIVE_X_PROPORTIONAL)
#define SHADOW_STRIDE (FD_REG_SHADOW_Z_PROPORTIONAL - FD_REG_SHADOW_X_PROPORTIONAL)
#define SHADOW_WORDS (FD_REG_SHADOW_CRC - FD_REG_SHADOW_X_PROPORTIONAL)

static struct fd_gain_bank active[FD_AXES], previous[FD_AXES];
static bool unconfirmed, staged_crc_ok;
static uint32_t committed_us;

static void put_active(const struct fd_gain_bank gains[FD_AXES])
{
    memcpy(active, gains, sizeof active);
    register_put_gains(FD_REG_ACTIVE_X_PROPORTIONAL, ACTIVE_STRIDE, active);
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
    const uint16_t *words = register_words(FD_REG_SHADOW_X_PROPORTIONAL);
    staged_crc_ok = crc32_of_words(words, SHADOW_WORDS) == register_u32(FD_REG_SHADOW_CRC);
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
static const struct fd_gain_bank may_be_negative = {
    .offset_feedforward = 1.0f,
    .viscous_difference_feedforward = 1.0f,
    .ripple_cosine = {1.0f, 1.0f, 1.0f, 1.0f},
    .ripple_sine = {1.0f, 1.0f, 1.0f, 1.0f},
};
static const struct fd_gain_bank must_be_positive = {
    .coulomb_smoothing = 1.0f,
    .stribeck_speed = 1.0f,
    .ripple_period = {1.0f, 1.0f, 1.0f, 1.0f},
};

/* A bank as a row of floats. */
struct row {
    float number[BANK_FLOATS];
};

static struct row row_of(const struct fd_gain_bank *gains)
{
    struct row row;
    memcpy(&row, gains, sizeof row);
    return row;
}

/* Whether a number may stand in the place that the marks tell of; a NaN may in none. */
static bool allowed(float number, float maximum, bool negative, bool positive)
{
    return isfinite(number) && fabsf(number) <= maximum && (negative || number >= 0.0f)
        && (!positive || number > 0.0f);
}

bool gain_banks_within_maxima(const struct fd_gain_bank gains[FD_AXES])
{
    const struct row negative = row_of(&may_be_negative), positive = row_of(&must_be_positive);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        const struct row maxima = row_of(&port_settings()->axis[axis].gain_maximum);
        const struct row row = row_of(&gains[axis]);
        for (unsigned n = 0; n < BANK_FLOATS; n++) {
            if (!allowed(row.number[n], maxima.number[n], negative.number[n] > 0.0f,
                         positive.number[n] > 0.0f)) {
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
        const struct row maxima = row_of(&settings->gain_maximum);
        const struct row now = row_of(&active[axis]), then = row_of(&staged[axis]);
        for (unsigned n = 0; n < BANK_FLOATS; n++) {
            const float change = fabsf(then.number[n] - now.number[n]);
            if (!(change <= settings->gain_step * maxima.number[n])) {
                return false;
            }
        }
    }
    return true;
}

enum fd_result gain_banks_commit(uint32_t crc)
{
    struct fd_gain_bank staged[FD_AXES];
    if (unconfirmed) {
        return FD_RESULT_UNCONFIRMED;
    }
    if (!staged_crc_ok || register_u32(FD_REG_SHADOW_CRC) != crc) {
        return FD_RESULT_GAIN_CRC;
    }
    register_take_gains(FD_REG_SHADOW_X_PROPORTIONAL, SHADOW_STRIDE, staged);
    if (!gain_banks_within_maxima(staged) || !within_step(staged)) {
        return FD_RESULT_GAIN_LIMITS;
    }
    memcpy(previous, active, sizeof previous);
    put_active(staged);
    unconfirmed = true;
    committed_us = port_time_us();
    return FD_RESULT_DONE;
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
