#include "fuzz_values.h"

#include <math.h>
#include <string.h>

#include "../settings.h"

#define BANK_FLOATS (sizeof(struct fd_gain_bank) / sizeof(float))

static uint64_t state;

void fuzz_seed(uint64_t seed)
{
    state = seed * 0x9e3779b97f4a7c15ull + 1u;
}

/* xorshift64* */
uint32_t fuzz_random(void)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (uint32_t)((state * 0x2545f4914f6cdd1dull) >> 32);
}

uint32_t fuzz_below(uint32_t limit)
{
    return fuzz_random() % limit;
}

bool fuzz_rarely(uint32_t times)
{
    return fuzz_below(times) == 0;
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
    const uint32_t times = fuzz_rarely(2) ? 6u : 1000000u; /* half of all tables are clean */
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
    const uint32_t times = fuzz_rarely(3) ? 100u : 1000000u;
    memcpy(numbers, gains, sizeof numbers);
    memcpy(largest, maxima, sizeof largest);
    for (unsigned n = 0; n < BANK_FLOATS; n++) {
        numbers[n] = spoilt(numbers[n] * fuzz_between(0.9f, 1.1f), times);
        if (fuzz_rarely(12)) { /* seldom beyond what the board allows, and as often off again */
            numbers[n] = fuzz_rarely(2) ? fuzz_between(0.0f, 0.3f) * largest[n]
                                        : fuzz_between(0.0f, 0.002f) * largest[n];
        }
    }
    memcpy(gains, numbers, sizeof numbers);
}
