#include "period.h"

#include <string.h>

#include "../numbers.h"

#define DIFFERENCES 3u

static struct period_axis axes[FD_AXES];
static struct {
    int64_t position, effort;
    int32_t first_position;
    int64_t differences[DIFFERENCES]; /* of the sample before: position, first, second */
} sums[FD_AXES];
static uint32_t samples; /* of the period */
static uint32_t taken;
static uint32_t block;
static uint32_t left; /* of the block, in 1024ths of a sample; a block has as many as samples */

void period_begin(uint32_t of_samples)
{
    memset(sums, 0, sizeof sums);
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        axes[axis].third_differences = 0.0;
    }
    samples = of_samples;
    taken = block = 0;
    left = samples;
}

uint32_t period_samples(void)
{
    return samples;
}

const struct period_axis *period_of(unsigned axis)
{
    return &axes[axis];
}

static void add_noise(unsigned axis, int64_t position)
{
    int64_t difference = position;
    for (uint32_t order = 0; order < DIFFERENCES; order++) {
        const int64_t before = sums[axis].differences[order];
        sums[axis].differences[order] = difference;
        difference -= before;
    }
    if (taken >= DIFFERENCES) {
        axes[axis].third_differences += (double)difference * (double)difference;
    }
}

static void add(unsigned axis, int64_t position, int64_t effort, uint32_t part)
{
    sums[axis].position += position * part;
    sums[axis].effort += effort * part;
}

static void close_block(void)
{
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        axes[axis].position[block] = (float)sums[axis].position;
        axes[axis].effort[block] = (float)sums[axis].effort;
        sums[axis].position = sums[axis].effort = 0;
    }
    block++;
    left = samples;
}

void period_add(const struct drive_sample *sample)
{
    int64_t position[FD_AXES];
    if (block == PERIOD_BLOCKS || samples == 0) {
        return;
    }
    /* a sample has 1024 parts: those that end the block, and those that begin the next */
    const uint32_t now = left < PERIOD_BLOCKS ? left : PERIOD_BLOCKS;
    for (unsigned axis = 0; axis < FD_AXES; axis++) {
        if (taken == 0) {
            sums[axis].first_position = sample->position[axis];
        }
        position[axis] = counts_between(sample->position[axis], sums[axis].first_position);
        add_noise(axis, position[axis]);
        add(axis, position[axis], sample->effort[axis], now);
    }
    taken++;
    left -= now;
    if (left > 0) {
        return;
    }
    close_block();
    for (unsigned axis = 0; axis < FD_AXES && now < PERIOD_BLOCKS; axis++) {
        add(axis, position[axis], sample->effort[axis], PERIOD_BLOCKS - now);
    }
    left -= PERIOD_BLOCKS - now;
}
