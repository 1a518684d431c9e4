#include "fuzz_values.h"

#include <math.h>
#include <string.h>

#include "../settings.h"

#define BANK_FLOATS (sizeof(struct fd_gain_bank) / sizeof(float))
#define FIRST_FLOATS 9u /* feedback and the feed-forward of a rigid body */
#define NEVER 0u

static const uint8_t *choices;
static size_t left;

void fuzz_choose_from(const uint8_t *bytes, size_t length)
{
    choices = bytes;
    left = length;
}

bool fuzz_exhausted(void)
{
    return left == 0;
}

/* So many bytes as a number; zeros where there are none any more. */
static uint32_t taken(unsigned count)
{
    uint32_t number = 0;
    for (; count > 0; count--) {
        number <<= 8;
        if (left > 0) {
            number |= *choices++;
            left--;
        }
    }
    return number;
}

uint32_t fuzz_random(void)
{
    return taken(4u);
}

uint32_t fuzz_below(uint32_t limit)
{
    return taken(limit <= 1u << 8 ? 1u : limit <= 1u << 16 ? 2u : limit <= 1u << 24 ? 3u : 4u) % limit;
}

/* The last of so many, so that nothing rare happens when there are no bytes left. */
bool fuzz_rarely(uint32_t times)
{
    return times != NEVER && fuzz_below(times) == times - 1u;
}

float fuzz_between(float lowest, float highest)
{
    return lowest + (highest - lowest) * (float)fuzz_below(1u << 20) / (float)(1u << 20);
}

float fuzz_hostile(void)
{
    static const float numbers[] = {
        0.0f, 1e-45f, 1e-30f, 1e-10f, 1e-3f, 1.0f, 12.0f, 1e3f, 1256.63f, 1256.65f, 1e10f, 1e19f,
        1e25f, 3.4e38f, INFINITY, NAN,
    };
    const uint32_t raw = fuzz_random();
    float number;
    memcpy(&number, &raw, sizeof number);
    if (!fuzz_rarely(4)) {
        number = numbers[fuzz_below(sizeof numbers / sizeof numbers[0])];
    }
    return fuzz_rarely(2) ? -number : number;
}

/* A number as asked for, mostly. */
static float spoilt(float number, uint32_t times)
{
    return fuzz_rarely(times) ? fuzz_hostile() : number;
}

static void put_sines(uint16_t *table, unsigned axis, uint32_t times)
{
    const unsigned components = 1u + (fuzz_rarely(3) ? fuzz_below(8) : 0);
    client_set_u16(table, axis, FD_REG_TRAJECTORY_X_COMPONENTS, (uint16_t)components);
    for (unsigned n = 0; n < components; n++) {
        const float amplitude = fuzz_between(0.0f, 1.5f) / (float)components;
        client_set_f32(table, axis, FD_REG_TRAJECTORY_X_AMPLITUDE, n, spoilt(amplitude, times));
        client_set_f32(table, axis, FD_REG_TRAJECTORY_X_ANGULAR_FREQUENCY, n,
                       spoilt(fuzz_between(0.0f, 4.0f), times));
        client_set_f32(table, axis, FD_REG_TRAJECTORY_X_PHASE, n,
                       spoilt(fuzz_between(-3.0f, 3.0f), times));
    }
}

/* Two components that cancel each other: where they overflow, what is left is no number. */
static void put_twins(uint16_t *table, unsigned axis)
{
    const float amplitude = fuzz_hostile(), rate = fuzz_between(0.0f, 1200.0f);
    client_set_u16(table, axis, FD_REG_TRAJECTORY_X_COMPONENTS, 2u);
    for (unsigned n = 0; n < 2u; n++) {
        client_set_f32(table, axis, FD_REG_TRAJECTORY_X_AMPLITUDE, n, n ? -amplitude : amplitude);
        client_set_f32(table, axis, FD_REG_TRAJECTORY_X_ANGULAR_FREQUENCY, n, rate);
    }
}

static void put_stairs(uint16_t *table, unsigned axis, uint32_t times)
{
    const unsigned levels = 1u + fuzz_below(12);
    client_set_u16(table, axis, FD_REG_TRAJECTORY_X_LEVELS, (uint16_t)levels);
    for (unsigned n = 0; n < levels; n++) {
        client_set_f32(table, axis, FD_REG_TRAJECTORY_X_LEVEL_SPEED, n,
                       spoilt(fuzz_between(-2.0f, 2.0f), times));
    }
    client_set_f32(table, axis, FD_REG_TRAJECTORY_X_DWELL, 0,
                   spoilt(fuzz_between(0.0f, 0.5f), times));
    client_set_f32(table, axis, FD_REG_TRAJECTORY_X_ACCELERATION, 0,
                   spoilt(fuzz_between(1.0f, 70.0f), times));
}

void fuzz_table(uint16_t table[TABLE_WORDS])
{
    const uint32_t times = fuzz_rarely(2) ? 6u : NEVER; /* half of all tables are clean */
    const bool stairs = fuzz_rarely(3);
    const uint32_t capture = 1u + fuzz_below(fuzz_rarely(200) ? 200000u : fuzz_rarely(20) ? 6000u
                                                                                      : 400u);
    client_begin_table(table, stairs ? FD_TRAJECTORYKIND_STAIRCASE : FD_TRAJECTORYKIND_MULTISINE,
                       40u + fuzz_below(600), capture);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        if (stairs) {
            put_stairs(table, axis, times);
        } else if (fuzz_rarely(times)) {
            put_twins(table, axis);
        } else {
            put_sines(table, axis, times);
        }
    }
    if (fuzz_rarely(50)) {
        table[fuzz_below(TABLE_WORDS)] = (uint16_t)fuzz_random();
    }
}

void fuzz_gains(struct fd_gain_bank *gains, const struct fd_gain_bank *maxima)
{
    float numbers[BANK_FLOATS], largest[BANK_FLOATS];
    const uint32_t times = fuzz_rarely(3) ? 6u : NEVER;
    memcpy(numbers, gains, sizeof numbers);
    memcpy(largest, maxima, sizeof largest);
    for (unsigned left_to_change = fuzz_below(8); left_to_change > 0; left_to_change--) {
        const unsigned n = fuzz_below(fuzz_rarely(2) ? FIRST_FLOATS : BANK_FLOATS);
        /* seldom beyond what the board allows, and as often off again */
        const float most = fuzz_rarely(2) ? 0.3f : 0.002f;
        numbers[n] = spoilt(fuzz_between(0.0f, most) * largest[n], times);
    }
    memcpy(gains, numbers, sizeof numbers);
}
