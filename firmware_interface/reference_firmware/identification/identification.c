#include "../identification.h"

#include <math.h>
#include <string.h>

#include "../crc.h"
#include "../port.h"
#include "../register_file.h"
#include "network_loop.h"
#include "pause.h"

#define PIECE 64u /* blocks that are copied with the lock at once */
#define MISSING_SHARE 0.002 /* of the period, that a capture may lack */
#define STRIDE (FD_REG_IDENTIFICATION_Z_REASON - FD_REG_IDENTIFICATION_X_REASON)

/* Shared with the sample interrupt, under the lock. */
static enum fd_identificationstate state;
static uint16_t token;
static uint32_t motions; /* begun since power-up */
static struct network_answer answers[FD_AXES];
static bool unpublished;

/* Of the main loop alone. */
static uint32_t motion; /* that is being computed */
static bool computing;
static void (*serve_others)(void);
static struct conditioned seen[FD_AXES];
static union {
    struct conditioning_memory conditioning;
    struct loop_memory loop;
} memory; /* first the one, then the other */

void identification_init(void)
{
    state = FD_IDENTIFICATIONSTATE_NONE;
    token = 0;
    motions++;
    memset(answers, 0, sizeof answers);
    unpublished = true;
    period_begin(0);
}

void identification_begin(uint16_t of_token, uint32_t capture_samples)
{
    const double period = NETWORK_PERIOD_S / (SAMPLE_PERIOD_NS * 1e-9);
    uint32_t samples = (uint32_t)lround(period);
    const bool enough = capture_samples >= PERIOD_BLOCKS
        && capture_samples >= samples * (1.0 - MISSING_SHARE);
    samples = samples < capture_samples ? samples : capture_samples;
    state = FD_IDENTIFICATIONSTATE_CAPTURING;
    token = of_token;
    motions++;
    memset(answers, 0, sizeof answers);
    unpublished = true;
    period_begin(enough ? samples : 0u);
}

void identification_add(const struct drive_sample *sample)
{
    period_add(sample);
}

void identification_captured(void)
{
    state = FD_IDENTIFICATIONSTATE_RUNNING;
    unpublished = true;
}

/* With the lock. */
static void fail(enum fd_identificationreason reason)
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        answers[axis].reason = reason;
    }
    state = FD_IDENTIFICATIONSTATE_FAILED;
    unpublished = true;
}

void identification_idle(void)
{
    if (state == FD_IDENTIFICATIONSTATE_CAPTURING) {
        fail(FD_IDENTIFICATIONREASON_STOPPED);
    }
}

/* ---- registers */

static void put_axis(uint16_t base, const struct network_answer *answer)
{
    register_put_u16(base, (uint16_t)answer->reason);
    register_put_u16((uint16_t)(base + 1u), answer->images);
    for (unsigned n = 0; n < NETWORK_PARAMETERS; n++) {
        register_put_f32((uint16_t)(base + 2u + 2u * n), answer->parameters[n]);
    }
    register_put_f32((uint16_t)(base + 2u + 2u * NETWORK_PARAMETERS), answer->relative_residual);
}

void identification_publish(void)
{
    const uint16_t first = FD_REG_IDENTIFICATION_STATE;
    if (!unpublished) {
        return;
    }
    unpublished = false;
    register_put_u16(FD_REG_IDENTIFICATION_STATE, (uint16_t)state);
    register_put_u16(FD_REG_IDENTIFICATION_MOTION, token);
    register_put_u32(FD_REG_IDENTIFICATION_NETWORK, NETWORK_CODE);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        put_axis((uint16_t)(FD_REG_IDENTIFICATION_X_REASON + axis * STRIDE), &answers[axis]);
    }
    register_put_u32(FD_REG_IDENTIFICATION_CRC,
                     crc32_of_words(register_words(first), FD_REG_IDENTIFICATION_CRC - first));
}

/* ---- computing */

/* Whether the motion that is being computed is still the last one. */
static bool goes_on(void)
{
    port_lock();
    const bool wanted = motion == motions;
    port_unlock();
    return wanted;
}

void identification_pause(void)
{
    serve_others();
}

/* In pieces, so that the sample interrupt does not wait; false where another motion has begun. */
static bool copy(unsigned axis, struct captured_axis *captured)
{
    bool wanted = true;
    for (uint32_t first = 0; first < PERIOD_BLOCKS && wanted; first += PIECE) {
        port_lock();
        const struct period_axis *period = period_of(axis);
        wanted = motion == motions;
        memcpy(&captured->position[first], &period->position[first], PIECE * sizeof(float));
        memcpy(&captured->effort[first], &period->effort[first], PIECE * sizeof(float));
        captured->third_differences = period->third_differences;
        captured->samples = period_samples();
        port_unlock();
        identification_pause();
    }
    return wanted;
}

/* Both axes; false where another motion has begun. */
static bool compute(struct network_answer found[FD_AXES])
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        if (!copy(axis, &memory.conditioning.captured)) {
            return false;
        }
        condition(&memory.conditioning, &seen[axis]);
    }
    for (unsigned axis = 0; axis < FD_AXES && goes_on(); axis++) {
        found[axis] = read_parameters(&seen[axis], &memory.loop, goes_on);
    }
    return goes_on();
}

/* With the lock. */
static void take(const struct network_answer found[FD_AXES])
{
    state = FD_IDENTIFICATIONSTATE_FAILED;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        answers[axis] = found[axis];
        if (found[axis].reason == FD_IDENTIFICATIONREASON_NONE) {
            state = FD_IDENTIFICATIONSTATE_DONE;
        }
    }
    unpublished = true;
}

/* Whether there is something to compute. */
static bool due(void)
{
    port_lock();
    const bool captured = state == FD_IDENTIFICATIONSTATE_RUNNING;
    if (captured && period_samples() == 0) {
        fail(FD_IDENTIFICATIONREASON_TOO_SHORT);
    }
    motion = motions;
    const bool found = captured && period_samples() > 0;
    port_unlock();
    return found;
}

void identification_go_on(void (*serve)(void))
{
    struct network_answer found[FD_AXES];
    if (computing || !due()) { /* it may be what serves while it computes */
        return;
    }
    computing = true;
    serve_others = serve;
    const bool complete = compute(found);
    port_lock();
    if (complete && motion == motions) {
        take(found);
    }
    port_unlock();
    computing = false;
}
